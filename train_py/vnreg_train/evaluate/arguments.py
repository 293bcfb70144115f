"""The evaluation's commands of `vnreg-train`: their arguments (see commands.py for the bodies)."""

from __future__ import annotations

import argparse
import os

from vnreg_train.command_help import Lesson, Subcommands, add_command

SPLITS = ("train", "validation", "test")

EVALUATE = Lesson(
    summary="measure methods on rows of pairs",
    reads="The shapes of a split, and their symmetries (data/symmetries); a model file, or the "
    "built-in model. Peers need requirements/evaluate.txt.",
    writes="RUN/METHOD/ROW.jsonl, every answer; a second call makes what is missing. Prints a "
    "line for each row and method.",
    takes="Mode verified 1 minute for all 29 rows of the test split (15 ms a pair); all modes and "
    "peers half an hour of one core.",
    example="evaluate --split validation --rows bars --shapes 40",
)
DISJOINT = Lesson(
    summary="how sure the engine is of pairs of different objects",
    reads="The shapes of a split, of which two different ones make a pair.",
    writes="Nothing. Prints how many confidences are above 0.5, 0.8 and 0.9, though every pose is "
    "wrong, and the statuses.",
    takes="25 ms a pair: half a minute with the defaults.",
    example="disjoint --pairs 1000 --split validation",
)
CALIBRATE = Lesson(
    summary="fit the confidence of a model file on validation pairs",
    reads="A model file; pairs of the split, which the engine aligns; the shapes' symmetries.",
    writes="OUT: the model with its calibration, by which the engine tells its confidence (NaN "
    "without one). Prints the numbers, and how they do on pairs that they were not fitted to.",
    takes="2 minutes of one core with the defaults (4,000 pairs).",
    example="calibrate mine.vnr --out mine.vnr --different 1500",
)
FIND_SYMMETRIES = Lesson(
    summary="list the symmetries of the furniture models",
    reads="The shapes, and their meshes in the package that build-data keeps in --cache.",
    writes="OUT: for each shape the rotations that leave it as it is, by which recall up to "
    "symmetry is counted.",
    takes="Some 3 seconds of one core a shape: 40 minutes for all 820.",
    example="find-symmetries --splits validation --out symmetries.json",
)
TUNE_PEERS = Lesson(
    summary="choose the peers' settings",
    reads="Validation pairs, and the grid of settings of each peer (evaluate/tuned_peers.json says "
    "what was tried). Needs requirements/evaluate.txt.",
    writes="evaluate/tuned_peers.json: the settings that register most pairs, with the grids.",
    takes="Some 15 minutes of one core with all peers.",
    example="tune-peers --peers small_gicp --shapes 12",
)
REPORT = Lesson(
    summary="write the results of a run down: page, JSON and plots",
    reads="The folder that `evaluate --run` filled; or a results.json of an earlier report.",
    writes="OUT, a page; beside it a folder of its name with results.json (every figure) and plots "
    "as SVG: recall against angle, overlap and noise, reliability, failures by category. The same "
    "answers give the same bytes.",
    takes="Two minutes of one core for all rows: the pairs are made again to tell the twins "
    "among the failures, and what the surface says of each. From a results.json 5 seconds.",
    example="report --run runs/evaluate --out docs/results.md",
)


GALLERY = Lesson(
    summary="show the worst pairs of a run in one HTML file",
    reads="The folder that `evaluate --run` filled, for one of the engine's modes. The pairs are "
    "made again from their seeds and aligned once more, by the built-in model or --model.",
    writes="OUT: a card for each pair with a still, its errors, confidence and status, and the 3D "
    "viewer on click. It needs no network and no server: 0.65 MB and 0.1 MB a pair.",
    takes="15 seconds of one core for all rows and 24 cards.",
    example="gallery --run runs/evaluate -o gallery.html --rows P1/noise_0.01 --count 12",
)


def add_evaluation_commands(commands: Subcommands) -> None:
    """evaluate, disjoint, calibrate, find-symmetries, tune-peers, report, gallery."""
    _add_evaluate(add_command(commands, "evaluate", EVALUATE))
    _add_disjoint(add_command(commands, "disjoint", DISJOINT))
    _add_calibrate(add_command(commands, "calibrate", CALIBRATE))
    _add_find_symmetries(add_command(commands, "find-symmetries", FIND_SYMMETRIES))
    _add_tune_peers(add_command(commands, "tune-peers", TUNE_PEERS))
    _add_report(add_command(commands, "report", REPORT))
    _add_gallery(add_command(commands, "gallery", GALLERY))


def _add_pairing(command: argparse.ArgumentParser, split: str, seed: int) -> None:
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument("--split", default=split, choices=SPLITS, help="of the shapes")
    command.add_argument("--shapes", type=int, help="only so many, spread evenly over the split")
    command.add_argument("--seed", type=int, default=seed, help="of the pairs")


def _add_evaluate(command: argparse.ArgumentParser) -> None:
    _add_pairing(command, "test", 0)
    command.add_argument(
        "--rows", nargs="+", default=["all"], help="all, bars, p0, p1, or names with wildcards"
    )
    command.add_argument(
        "--methods", nargs="+", default=["verified"], help="modes, peers, or names of either"
    )
    command.add_argument("--model", help="for mode verified, a .vnr file (default: built in)")
    command.add_argument(
        "--paper-model", default="models/small.vnr", help="for modes coarse, paper"
    )
    command.add_argument("--jobs", type=int, default=1, help="processes, one thread each")
    command.add_argument("--failures", action="store_true", help="list the pairs that were lost")
    command.add_argument("--run", help="folder that keeps the answers; a second call goes on")
    command.set_defaults(run_command=_evaluate)


def _add_disjoint(command: argparse.ArgumentParser) -> None:
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument("--split", default="validation", choices=SPLITS, help="of the shapes")
    command.add_argument("--pairs", type=int, default=1000, help="how many")
    command.add_argument("--seed", type=int, default=0, help="of the pairs")
    command.set_defaults(run_command=_disjoint)


def _add_calibrate(command: argparse.ArgumentParser) -> None:
    command.add_argument("model", help="a .vnr file")
    command.add_argument(
        "--mode", default="verified", choices=("paper", "verified"), help="whose confidence"
    )
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument("--split", default="validation", choices=SPLITS[:2], help="of the shapes")
    command.add_argument("--shapes", type=int, help="only so many, spread evenly over the split")
    command.add_argument("--seeds", nargs="+", type=int, default=[11, 12, 13], help="of the pairs")
    command.add_argument(
        "--different", type=int, default=0, help="so many pairs of different objects, too"
    )
    command.add_argument("--out", help="write the model with its calibration here (may be itself)")
    command.set_defaults(run_command=_calibrate)


def _add_find_symmetries(command: argparse.ArgumentParser) -> None:
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument("--cache", default="data/furniture/cache", help="where packages are kept")
    command.add_argument(
        "--splits", nargs="+", default=list(SPLITS), choices=SPLITS, help="only these"
    )
    command.add_argument("--out", default="data/symmetries/furniture.json", help="the list")
    command.set_defaults(run_command=_find_symmetries)


def _add_tune_peers(command: argparse.ArgumentParser) -> None:
    _add_pairing(command, "validation", 7)
    command.add_argument("--peers", nargs="+", help="only these")
    command.set_defaults(run_command=_tune_peers, shapes=24)


def _add_report(command: argparse.ArgumentParser) -> None:
    _add_pairing(command, "test", 0)
    origin = command.add_mutually_exclusive_group(required=True)
    origin.add_argument("--run", help="folder that `evaluate --run` filled")
    origin.add_argument("--figures", help="a results.json, to draw page and plots of it again")
    command.add_argument("--out", default="docs/results.md", help="the page; figures beside it")
    command.set_defaults(run_command=_report)


def _add_gallery(command: argparse.ArgumentParser) -> None:
    command.add_argument("--run", required=True, help="folder that `evaluate --run` filled")
    command.add_argument("-o", "--out", required=True, help="the HTML file")
    command.add_argument(
        "--rows", nargs="+", default=["all"], help="all, bars, p0, p1, or names with wildcards"
    )
    command.add_argument("--count", type=int, default=24, help="of pairs, at the most")
    command.add_argument(
        "--order",
        default="confidence",
        choices=("confidence", "error"),
        help="what is worst: the surest mistakes, or those farthest off",
    )
    command.add_argument(
        "--mode", default="verified", choices=("coarse", "paper", "verified"), help="whose answers"
    )
    command.add_argument("--model", help="the .vnr file behind them (default: built in)")
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.set_defaults(run_command=_gallery)


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


def _gallery(arguments: argparse.Namespace) -> None:
    _use_one_thread()
    from vnreg_train.evaluate.commands import gallery_main

    gallery_main(arguments)
