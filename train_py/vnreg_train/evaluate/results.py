"""All figures of a run in one JSON: what docs/results.md is written from."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from vnreg_train.evaluate.bars import METHOD
from vnreg_train.evaluate.failure_kinds import by_category
from vnreg_train.evaluate.measures import confidence, measure, nees
from vnreg_train.evaluate.pairs import split_shapes
from vnreg_train.evaluate.rows import ROWS, Row
from vnreg_train.evaluate.run import Pairing, answers_path, read_answers
from vnreg_train.evaluate.scores import Scores, concatenated, score
from vnreg_train.evaluate.symmetry import SymmetryGroup

# Confidence and covariance are also told of these rows together.
POOLS = {
    "P0": lambda row: row.protocol == "P0",
    "P1": lambda row: row.protocol == "P1",
    "views": lambda row: row.protocol == "views",
    "all": lambda row: True,
}


def collect_results(
    folder: Path, pairing: Pairing, groups: Mapping[str, SymmetryGroup]
) -> dict[str, Any]:
    """From the answers in a run's folder; rows that a method lacks answers to are left out.

    Raises ValueError where there are none at all.
    """
    methods: dict[str, Any] = {}
    rows: dict[str, Any] = {}
    scored: dict[str, dict[Row, Scores]] = {}
    categories: dict[Row, list[str]] = {}  # of the shapes of METHOD's pairs
    names = sorted(path.name for path in folder.iterdir() if path.is_dir())
    for row in ROWS.values():
        pairs = None
        for name in names:
            found = _answers(folder, name, row, pairing)
            if found is None:
                continue
            pairs = list(pairing.pairs(row)) if pairs is None else pairs
            methods.setdefault(name, found[0])
            if methods[name] != found[0]:
                raise ValueError(f"{name}: {row.name} was answered by another version of it")
            shapes = split_shapes(pairing.split, pairing.data) if name == METHOD else None
            if shapes is not None:
                categories[row] = [shapes.categories[shapes.label[pair.shape]] for pair in pairs]
            scores = score(pairs, found[1], groups, shapes)
            rows.setdefault(row.name, {})[name] = measure(scores)
            scored.setdefault(name, {})[row] = scores
    if not rows:
        raise ValueError(f"{folder} holds no answers to the {pairing.split} split's pairs")
    return {
        "about": about(pairing, groups),
        "methods": methods,
        "rows": rows,
        "pooled": {name: pooled(of_row) for name, of_row in scored.items()},
        "categories": categorised(scored.get(METHOD, {}), categories),
    }


def _answers(folder: Path, name: str, row: Row, pairing: Pairing) -> tuple[Any, list[Any]] | None:
    """The method's identity and its answers in order; None where an answer is missing."""
    path = answers_path(folder, name, row)
    if not path.exists():
        return None
    head, known = read_answers(path)
    indices = pairing.indices()
    if (head["split"], head["seed"]) != (pairing.split, pairing.seed) or set(indices) - set(known):
        return None
    return head["method"], [known[index] for index in indices]


def pooled(of_row: Mapping[Row, Scores]) -> dict[str, Any]:
    """Confidence and covariance over the rows of each pool."""
    figures = {}
    for pool, belongs in POOLS.items():
        parts = [scores for row, scores in of_row.items() if belongs(row)]
        if parts:
            together = concatenated(parts)
            figures[pool] = {"confidence": confidence(together), "nees": nees(together)}
    return figures


def categorised(
    of_row: Mapping[Row, Scores], categories: Mapping[Row, Sequence[str]]
) -> dict[str, Any]:
    """Kinds of failure by category of the shape, over the rows of each pool but \"all\"."""
    tables = {}
    for pool, belongs in POOLS.items():
        rows = [row for row in of_row if belongs(row)]
        if rows and pool != "all":
            names = [name for row in rows for name in categories[row]]
            tables[pool] = by_category(concatenated([of_row[row] for row in rows]), names)
    return tables


def about(pairing: Pairing, groups: Mapping[str, SymmetryGroup]) -> dict[str, Any]:
    """What the figures were measured on, and with."""
    pairs = list(pairing.pairs(ROWS["P1/independent"]))
    return {
        "split": pairing.split,
        "seed": pairing.seed,
        "shapes": len(pairs),
        "symmetric_shapes": sum(not groups[pair.name].trivial for pair in pairs),
        "cpu": cpu_name(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "scipy": version("scipy"),
    }


def cpu_name() -> str:
    """As /proc/cpuinfo has it, where there is one."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or "unknown"


def write_results(results: dict[str, Any], path: Path) -> None:
    """As JSON, a line for each method of a row; creates the folder where needed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(_text(_rounded(results), 3) + "\n", encoding="utf-8")


def _text(value: Any, levels: int, indent: str = "") -> str:
    """JSON that opens only so many levels of objects to lines of their own."""
    if levels == 0 or not isinstance(value, dict) or not value:
        return json.dumps(value, allow_nan=False)
    deeper = indent + " "
    lines = [f"{deeper}{json.dumps(k)}: {_text(v, levels - 1, deeper)}" for k, v in value.items()]
    return "{\n" + ",\n".join(lines) + f"\n{indent}}}"


def _rounded(value: Any) -> Any:
    """Floats to seven significant digits: more is noise in a diff."""
    if isinstance(value, dict):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_rounded(one) for one in value]
    return float(f"{value:.7g}") if isinstance(value, float) else value
