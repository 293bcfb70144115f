"""The bodies of the evaluation's commands."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

from vnreg_train.evaluate.methods import MODES, EngineMethod, Method
from vnreg_train.evaluate.peers import PEERS, tuned_peer
from vnreg_train.evaluate.rows import select_rows
from vnreg_train.evaluate.run import Pairing, answer_all
from vnreg_train.evaluate.scores import score
from vnreg_train.evaluate.symmetry import SYMMETRIES, read_symmetries
from vnreg_train.evaluate.table import HEAD, LEGEND, line


def make_methods(arguments: argparse.Namespace) -> list[Callable[[], Method]]:
    """How to make each method that --methods names. Raises ValueError for an unknown one."""
    makers: list[Callable[[], Method]] = []
    for name in select_methods(arguments.methods):
        path = arguments.paper_model if name == "paper" else arguments.model
        if name in PEERS:
            makers.append(partial(tuned_peer, name))
        else:
            makers.append(partial(EngineMethod, name, Path(path) if path else None))
    return makers


def select_methods(names: Sequence[str]) -> list[str]:
    """Modes and peers by name; `modes`, `peers` for all of them. ValueError for others."""
    groups = {"modes": list(MODES), "peers": list(PEERS)}
    known = [*MODES, *PEERS]
    chosen: list[str] = []
    for name in names:
        if name not in groups and name not in known:
            raise ValueError(f"no method is called {name!r}; known are {', '.join(known)}")
        chosen += [one for one in groups.get(name, [name]) if one not in chosen]
    return chosen


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

    pairing = Pairing(arguments.split, arguments.shapes, data=Path(arguments.data))
    model = Path(arguments.model)
    calibration = calibrate_model(
        model, arguments.mode, pairing, arguments.seeds, read_symmetries()
    )
    print(json.dumps(asdict(calibration), indent=1))
    if arguments.out:
        write_calibrated(model, Path(arguments.out), calibration)


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


def tune_peers_main(arguments: argparse.Namespace) -> None:
    """Tries every point of the peers' grids and writes the best ones down."""
    from vnreg_train.evaluate.peers import TUNED
    from vnreg_train.evaluate.tune import tune_peers

    pairing = Pairing(arguments.split, arguments.shapes, arguments.seed, Path(arguments.data))
    tune_peers(arguments.peers or list(PEERS), pairing, read_symmetries(), TUNED)
