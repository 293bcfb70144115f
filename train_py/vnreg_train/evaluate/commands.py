"""The bodies of the evaluation's commands."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path

from vnreg_train.data.shapes import load_shapes
from vnreg_train.evaluate.methods import MODES, EngineMethod, Method
from vnreg_train.evaluate.rows import select_rows
from vnreg_train.evaluate.run import Pairing, answer_all
from vnreg_train.evaluate.scores import score
from vnreg_train.evaluate.symmetry import SYMMETRIES, read_symmetries
from vnreg_train.evaluate.table import HEAD, LEGEND, line


def make_methods(arguments: argparse.Namespace) -> list[Callable[[], Method]]:
    """How to make each method that --methods names. Raises ValueError for an unknown one."""
    makers: list[Callable[[], Method]] = []
    for name in arguments.methods:
        if name not in MODES:
            raise ValueError(f"no method is called {name!r}; known are {', '.join(MODES)}")
        path = arguments.paper_model if name == "paper" else arguments.model
        makers.append(partial(EngineMethod, name, Path(path) if path else None))
    return makers


def evaluate_main(arguments: argparse.Namespace) -> None:
    """Aligns every pair by every method; prints a line per row and method."""
    pairing = Pairing(arguments.split, arguments.shapes, arguments.seed, Path(arguments.data))
    groups = read_symmetries(SYMMETRIES) if SYMMETRIES.exists() else {}
    folder = Path(arguments.run) if arguments.run else None
    print(HEAD, flush=True)
    rows = select_rows(arguments.rows)
    for name, row, estimates in answer_all(
        make_methods(arguments), rows, pairing, folder, arguments.jobs
    ):
        print(line(row.name, name, score(list(pairing.pairs(row)), estimates, groups)), flush=True)
    print(LEGEND)


def calibrate_main(arguments: argparse.Namespace) -> None:
    """Fits the confidence; prints it as JSON, and writes the calibrated model to --out."""
    from vnreg_train.evaluate.calibrate import calibrate_model, write_calibrated

    shapes = load_shapes(Path(arguments.data), arguments.split, queries=0)
    calibration = calibrate_model(
        Path(arguments.model), shapes, threads=arguments.threads, limit=arguments.limit
    )
    print(json.dumps(asdict(calibration), indent=1))
    if arguments.out:
        write_calibrated(Path(arguments.model), Path(arguments.out), calibration)


def find_symmetries_main(arguments: argparse.Namespace) -> None:
    """Writes the list of symmetries; says how many shapes have any."""
    from vnreg_train.evaluate.symmetry_file import find_furniture_symmetries, symmetries_text

    groups = find_furniture_symmetries(
        Path(arguments.data), Path(arguments.cache), arguments.splits
    )
    out = Path(arguments.out)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(symmetries_text(groups), encoding="utf-8")
    print(f"{sum(not group.trivial for group in groups.values())} of {len(groups)} have symmetries")
