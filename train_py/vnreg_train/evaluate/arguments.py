"""The evaluation's commands of `vnreg-train`: their arguments (see commands.py for the bodies)."""

from __future__ import annotations

import argparse
import os
from typing import Any

Subcommands = Any  # argparse names the type privately


def add_evaluation_commands(commands: Subcommands) -> None:
    """evaluate, disjoint, calibrate, find-symmetries, tune-peers, report."""
    _add_evaluate(commands.add_parser("evaluate", help="measure methods on rows of pairs"))
    _add_disjoint(
        commands.add_parser("disjoint", help="how sure the engine is of pairs of different objects")
    )
    _add_calibrate(commands.add_parser("calibrate", help="fit the confidence on validation pairs"))
    _add_find_symmetries(
        commands.add_parser("find-symmetries", help="list the symmetries of the furniture models")
    )
    _add_tune_peers(commands.add_parser("tune-peers", help="choose the peers' settings"))
    _add_report(commands.add_parser("report", help="write the results of a run down"))


def _add_pairing(command: argparse.ArgumentParser, split: str, seed: int) -> None:
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument("--split", default=split, choices=("train", "validation", "test"))
    command.add_argument("--shapes", type=int, help="only so many, spread evenly over the split")
    command.add_argument("--seed", type=int, default=seed)
    command.add_argument("--jobs", type=int, default=1, help="processes, one thread each")


def _add_evaluate(command: argparse.ArgumentParser) -> None:
    _add_pairing(command, "test", 0)
    command.add_argument(
        "--rows", nargs="+", default=["all"], help="all, bars, p0, p1, or names with wildcards"
    )
    command.add_argument("--methods", nargs="+", default=["verified"])
    command.add_argument("--model", help="for mode verified, a .vnr file (default: built in)")
    command.add_argument(
        "--paper-model", default="models/small.vnr", help="for modes coarse, paper"
    )
    command.add_argument("--failures", action="store_true", help="list the pairs that were lost")
    command.add_argument("--run", help="folder that keeps the answers; a second call goes on")
    command.set_defaults(run_command=_evaluate)


def _add_disjoint(command: argparse.ArgumentParser) -> None:
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument("--split", default="validation", choices=("train", "validation", "test"))
    command.add_argument("--pairs", type=int, default=1000)
    command.add_argument("--seed", type=int, default=0)
    command.set_defaults(run_command=_disjoint)


def _add_calibrate(command: argparse.ArgumentParser) -> None:
    command.add_argument("model", help="a .vnr file")
    command.add_argument("--mode", default="verified", choices=("paper", "verified"))
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument("--split", default="validation", choices=("train", "validation"))
    command.add_argument("--shapes", type=int, help="only so many, spread evenly over the split")
    command.add_argument("--seeds", nargs="+", type=int, default=[11, 12, 13])
    command.add_argument(
        "--different", type=int, default=0, help="so many pairs of different objects, too"
    )
    command.add_argument("--out", help="write the model with its calibration here (may be itself)")
    command.set_defaults(run_command=_calibrate)


def _add_find_symmetries(command: argparse.ArgumentParser) -> None:
    command.add_argument("--data", default="data/furniture")
    command.add_argument("--cache", default="data/furniture/cache", help="where packages are kept")
    command.add_argument("--splits", nargs="+", default=["train", "validation", "test"])
    command.add_argument("--out", default="data/symmetries/furniture.json")
    command.set_defaults(run_command=_find_symmetries)


def _add_tune_peers(command: argparse.ArgumentParser) -> None:
    _add_pairing(command, "validation", 7)
    command.add_argument("--peers", nargs="+", help="only these")
    command.set_defaults(run_command=_tune_peers, shapes=24)


def _add_report(command: argparse.ArgumentParser) -> None:
    _add_pairing(command, "test", 0)
    command.add_argument("--run", required=True, help="folder that `evaluate --run` filled")
    command.add_argument("--out", default="docs/results.md", help="the page; figures beside it")
    command.set_defaults(run_command=_report)


def _use_one_thread() -> None:
    """Every method is timed on one thread; call before anything that opens a thread pool loads."""
    os.environ["OMP_NUM_THREADS"] = "1"
    os.environ["OPENBLAS_NUM_THREADS"] = "1"


def _evaluate(arguments: argparse.Namespace) -> None:
    _use_one_thread()
    from vnreg_train.evaluate.commands import evaluate_main

    evaluate_main(arguments)


def _disjoint(arguments: argparse.Namespace) -> None:
    _use_one_thread()
    from pathlib import Path

    from vnreg_train.evaluate.disjoint import print_report

    print_report(Path(arguments.data), arguments.split, arguments.pairs, arguments.seed)


def _calibrate(arguments: argparse.Namespace) -> None:
    _use_one_thread()
    from vnreg_train.evaluate.commands import calibrate_main

    calibrate_main(arguments)


def _find_symmetries(arguments: argparse.Namespace) -> None:
    from vnreg_train.evaluate.commands import find_symmetries_main

    find_symmetries_main(arguments)


def _tune_peers(arguments: argparse.Namespace) -> None:
    _use_one_thread()
    from vnreg_train.evaluate.commands import tune_peers_main

    tune_peers_main(arguments)


def _report(arguments: argparse.Namespace) -> None:
    from vnreg_train.evaluate.commands import report_main

    report_main(arguments)
