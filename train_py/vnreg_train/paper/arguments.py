"""The commands of `vnreg-train` that make docs/paper.md."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from vnreg_train.command_help import Lesson, Subcommands, add_command

FOLDER = "docs/paper"
ABLATION = Lesson(
    summary="train and measure the lines of the paper's ablation",
    reads="The training and test splits of `build-data`, and a configuration that all lines share.",
    writes="RUN: a folder a line with checkpoints, curves, the model file and its result; what is "
    "there is not done again. OUT/ablation.json.",
    takes="Minutes a line and core with the shipped configuration.",
    example="paper-ablation --variants vectors shared --run runs/paper/ablation",
)
RECALL = Lesson(
    summary="collect the recall of modes coarse and paper for docs/paper.md",
    reads="The answers of `vnreg-train evaluate --rows p0 --methods coarse paper --run RUN`, and "
    "the curves of the network's training.",
    writes="OUT/recall.json and OUT/curve.json; with --longer OUT/longer.json alone, of a model "
    "whose fine register was set to more points and iterations by `export`.",
    takes="Seconds.",
    example="paper-recall --run runs/paper/evaluate",
)
ITERATIONS = Lesson(
    summary="measure what more points and iterations of the fine register bring",
    reads="Model files of the paper's network, and the validation shapes.",
    writes="OUT/iterations.json.",
    takes="Two minutes of one core.",
    example="paper-iterations models/small.vnr",
)
SPEED = Lesson(
    summary="time the engine with one shared encoder against two",
    reads="Nothing: time does not depend on the weights, which are random.",
    writes="OUT/speed.json.",
    takes="Half a minute.",
    example="paper-speed --rounds 41",
)
TRAINING_SPEED = Lesson(
    summary="time steps of training: compiled or not, bf16, widths, points",
    reads="Nothing: time does not depend on the points, which are random.",
    writes="OUT/training_speed.json.",
    takes="Some minutes, most of them for compiling.",
    example="paper-training-speed --steps 5",
)
PAGE = Lesson(
    summary="write docs/paper.md from the figures beside it",
    reads="The JSON files and notes.md in OUT, and the results of `report` for the peers.",
    writes="The page, beside the folder OUT and under its name.",
    takes="A second.",
    example="paper-page --out docs/paper",
)


def add_paper_commands(commands: Subcommands) -> None:
    """Those of every part of the page, and the page's own."""
    ablation = _add(commands, "paper-ablation", ABLATION, _ablation)
    ablation.add_argument("--config", default="ablation", help="the base configuration")
    ablation.add_argument("--run", default="runs/paper/ablation", help="folder of its trainings")
    _add_pairs(ablation)
    ablation.add_argument("--variants", nargs="+", help="only these (default: all)")
    recall = _add(commands, "paper-recall", RECALL, _recall)
    recall.add_argument("--run", default="runs/paper/evaluate", help="folder of the answers")
    recall.add_argument("--trained", default="runs/small", help="folder of the network's training")
    recall.add_argument("--refined", default="runs/refined", help="and of its fine register's")
    recall.add_argument("--longer", metavar="MODEL", help="the model file, if it is that one")
    _add_pairs(recall)
    iterations = _add(commands, "paper-iterations", ITERATIONS, _iterations)
    iterations.add_argument("model", help="a .vnr file")
    iterations.add_argument(
        "--before", metavar="MODEL", help="the same network before its fine register was refined"
    )
    iterations.add_argument("--seeds", nargs="+", type=int, default=[1, 2], help="of the pairs")
    _add_pairs(iterations, split="validation")
    speed = _add(commands, "paper-speed", SPEED, _speed)
    speed.add_argument("--rounds", type=int, default=41, help="alignments by each network")
    training = _add(commands, "paper-training-speed", TRAINING_SPEED, _training_speed)
    training.add_argument("--steps", type=int, default=5, help="timed steps of each line")
    training.add_argument("--lines", type=int, nargs="+", help="only these, numbered from 1")
    page = _add(commands, "paper-page", PAGE, _page)
    page.add_argument(
        "--benchmark", default="docs/benchmark/benchmark.json", help="the kernels' speed"
    )
    page.add_argument("--results", default="docs/results/results.json", help="the peers' figures")


def _add(
    commands: Subcommands, name: str, lesson: Lesson, body: Callable[[argparse.Namespace], None]
) -> argparse.ArgumentParser:
    command = add_command(commands, name, lesson)
    command.add_argument("--out", default=FOLDER, help="folder of the page's figures")
    command.set_defaults(run_command=body)
    return command


def _add_pairs(command: argparse.ArgumentParser, split: str = "test") -> None:
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument(
        "--split", default=split, choices=("validation", "test"), help="whose pairs are measured"
    )
    command.add_argument("--shapes", type=int, help="only so many of them, spread evenly")


def _write(arguments: argparse.Namespace, part: str, figures: dict[str, Any]) -> None:
    from vnreg_train.evaluate.results import write_results

    write_results(figures, Path(arguments.out) / f"{part}.json")


def _ablation(arguments: argparse.Namespace) -> None:
    from dataclasses import asdict

    from vnreg_train.evaluate.run import Pairing
    from vnreg_train.paper.ablation import run_ablation
    from vnreg_train.paper.variants import VARIANTS
    from vnreg_train.training.config import load_config

    names = arguments.variants or list(VARIANTS)
    unknown = sorted(set(names) - set(VARIANTS))
    if unknown:
        raise SystemExit(f"no variant is called {unknown[0]!r}; known are {', '.join(VARIANTS)}")
    base = load_config(arguments.config)
    pairing = Pairing(arguments.split, arguments.shapes, 0, Path(arguments.data))
    variants = run_ablation(base, Path(arguments.run), pairing, names)
    figures = {
        "split": pairing.split,
        "pairs": len(pairing.indices()),
        "config": json.loads(json.dumps(asdict(base))),
        "variants": variants,
    }
    _write(arguments, "ablation", figures)


def _recall(arguments: argparse.Namespace) -> None:
    from vnreg_train.evaluate.results import collect_results
    from vnreg_train.evaluate.run import Pairing
    from vnreg_train.evaluate.symmetry import read_symmetries
    from vnreg_train.model_file import read_model
    from vnreg_train.paper.ablation import STAGES, read_curves, trained_pairs

    pairing = Pairing(arguments.split, arguments.shapes, 0, Path(arguments.data))
    results = collect_results(Path(arguments.run), pairing, read_symmetries())
    kept = ("plain", "halves", "rotation_deg", "ms")
    rows = {
        row: {method: {k: of[k] for k in kept} for method, of in methods.items()}
        for row, methods in results["rows"].items()
    }
    figures = {"about": results["about"], "methods": results["methods"], "rows": rows}
    if arguments.longer:
        metadata, _ = read_model(Path(arguments.longer))
        keys = ("fine.iterations", "fine.keep_divisor")
        _write(arguments, "longer", figures | {"settings": {k: metadata[k] for k in keys}})
        return
    _write(arguments, "recall", figures)
    trained, refined = Path(arguments.trained), Path(arguments.refined)
    runs = {stage: (trained, stage) for stage in STAGES} | {"refined": (refined, "fine")}
    curves = {
        "curves": {name: read_curves(*run) for name, run in runs.items()},
        "pairs": {name: trained_pairs(*run) for name, run in runs.items()},
    }
    _write(arguments, "curve", curves)


def _iterations(arguments: argparse.Namespace) -> None:
    from vnreg_train.evaluate.run import Pairing
    from vnreg_train.paper.iterations import BEFORE_REFINING, measure_iterations

    pairing = Pairing(arguments.split, arguments.shapes, 0, Path(arguments.data))
    figures = measure_iterations(Path(arguments.model), pairing, arguments.seeds)
    if arguments.before:
        before = measure_iterations(
            Path(arguments.before), pairing, arguments.seeds, BEFORE_REFINING
        )
        figures["before"] = before["lines"]
    _write(arguments, "iterations", figures)


def _speed(arguments: argparse.Namespace) -> None:
    from vnreg_train.paper.speed import measure_speed

    _write(arguments, "speed", measure_speed(arguments.rounds))


def _training_speed(arguments: argparse.Namespace) -> None:
    import torch

    from vnreg_train.paper.training_speed import RECIPES, measure_training

    torch.set_num_threads(1)
    chosen = [RECIPES[k - 1] for k in arguments.lines or range(1, len(RECIPES) + 1)]
    _write(arguments, "training_speed", measure_training(arguments.steps, chosen))


def _page(arguments: argparse.Namespace) -> None:
    from vnreg_train.paper.page import markdown, read_figures

    folder = Path(arguments.out)
    figures = read_figures(folder, Path(arguments.results), Path(arguments.benchmark))
    notes = (folder / "notes.md").read_text(encoding="utf-8")
    folder.with_suffix(".md").write_text(markdown(figures, notes), encoding="utf-8")
