"""The bodies of the evaluation's commands."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

from vnreg_train.evaluate.methods import MODES, EngineMethod, Method
from vnreg_train.evaluate.pairs import split_shapes
from vnreg_train.evaluate.peers import PEERS, tuned_peer
from vnreg_train.evaluate.rows import select_rows
from vnreg_train.evaluate.run import Pairing, answer_all
from vnreg_train.evaluate.scores import score
from vnreg_train.evaluate.symmetry import SYMMETRIES, read_symmetries
from vnreg_train.evaluate.table import HEAD, LEGEND, failure_lines, line


def make_methods(arguments: argparse.Namespace) -> list[Callable[[], Method]]:
    """How to make each method that --methods names. Raises ValueError for an unknown one."""
    names = select_methods(arguments.methods)
    makers: list[Callable[[], Method]] = []
    for mode in MODES:
        if mode in names:
            path = arguments.model if mode == "verified" else arguments.paper_model
            makers.append(partial(EngineMethod, mode, Path(path) if path else None))
    return makers + [partial(tuned_peer, name) for name in PEERS if name in names]


def select_methods(patterns: Sequence[str]) -> set[str]:
    """Modes and peers by name, `modes` or `peers` for all of them. ValueError for others."""
    groups: dict[str, tuple[str, ...]] = {"modes": tuple(MODES), "peers": tuple(PEERS)}
    groups |= {name: (name,) for names in tuple(groups.values()) for name in names}
    unknown = [pattern for pattern in patterns if pattern not in groups]
    if unknown:
        raise ValueError(f"no method is called {unknown[0]!r}; known are {', '.join(groups)}")
    return {name for pattern in patterns for name in groups[pattern]}


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
        pairs = list(pairing.pairs(row))
        shapes = split_shapes(pairing.split, pairing.data) if arguments.failures else None
        scores = score(pairs, estimates, groups, shapes)
        lost = failure_lines(pairs, scores) if arguments.failures else []
        print("\n".join([line(row.name, name, scores), *lost]), flush=True)
    print(LEGEND)


def calibrate_main(arguments: argparse.Namespace) -> None:
    """Fits the confidence; prints it as JSON, and writes the calibrated model to --out."""
    from vnreg_train.evaluate.calibrate import calibrate_model, write_calibrated

    pairing = Pairing(arguments.split, arguments.shapes, data=Path(arguments.data))
    model = Path(arguments.model)
    calibration = calibrate_model(
        model, arguments.mode, pairing, arguments.seeds, read_symmetries(), arguments.different
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


def gallery_main(arguments: argparse.Namespace) -> None:
    """Writes the page --out; says how many pairs it has and how large it is."""
    import vnreg
    from vnreg_train.evaluate.gallery import gallery_page, make_card
    from vnreg_train.evaluate.worst_pairs import worst_pairs

    rows = select_rows(arguments.rows)
    mode, run, data = arguments.mode, Path(arguments.run), Path(arguments.data)
    groups = read_symmetries(SYMMETRIES) if SYMMETRIES.exists() else {}
    wrong = worst_pairs(run, mode, rows, data, groups, arguments.count, arguments.order)
    model = vnreg.Model.load(arguments.model) if arguments.model else vnreg.Model.builtin()
    registrar = vnreg.Registrar(model, mode=mode, threads=1)
    cards = [make_card(answer, registrar, model.name, mode) for answer in wrong]
    first = {"confidence": "the surest mistakes first", "error": "the farthest off first"}
    note = (
        f"{len(cards)} wrong answers of mode {mode}, model {model.name}, in "
        f"{' '.join(arguments.rows)} of {run.name}; {first[arguments.order]}."
    )
    page = Path(arguments.out)
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(gallery_page(cards, "The worst pairs", note), encoding="utf-8")
    print(f"{page}: {len(cards)} pairs, {page.stat().st_size / 1e6:.1f} MB, needs no network")


def report_main(arguments: argparse.Namespace) -> None:
    """Writes the page --out, and beside it the folder of its name with the JSON and the plots.

    Page and plots are made of what the JSON holds: --figures makes them again from such a file.
    """
    from vnreg_train.evaluate.plots import draw_plots
    from vnreg_train.evaluate.report import markdown
    from vnreg_train.evaluate.results import collect_results, write_results

    page = Path(arguments.out)
    folder = page.with_suffix("")
    figures = Path(arguments.figures or folder / "results.json")
    if arguments.run:
        pairing = Pairing(arguments.split, arguments.shapes, arguments.seed, Path(arguments.data))
        write_results(collect_results(Path(arguments.run), pairing, read_symmetries()), figures)
    results = json.loads(figures.read_text(encoding="utf-8"))
    plots = draw_plots(results, folder)
    page.write_text(markdown(results, plots, folder.name), encoding="utf-8")
