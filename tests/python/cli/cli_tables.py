"""Tables of pairs, and the results of `vnreg batch` in its three formats."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from cli_program import moved, random_pose
from numpy.typing import NDArray

COLUMNS = [
    "row",
    "id",
    "source",
    "target",
    "status",
    "T_target_source",
    "confidence",
    "overlap",
    "rmse",
    "inlier_distance",
    "score",
    "points_source",
    "points_target",
    "ms",
    "error",
]
FORMATS = ["csv", "jsonl", "parquet"]
# Small and quick: what is tested is the table, not the pose.
QUICK = ("--max-points", "64", "--mode", "coarse")

Row = dict[str, Any]


def write_clouds(folder: Path, shape: NDArray[np.float64], count: int) -> list[str]:
    """`count` samples of the shape in any pose; their names."""
    random = np.random.default_rng(7)
    names = [f"cloud_{i:03}.npy" for i in range(count)]
    for i, name in enumerate(names):
        points = shape[random.permutation(len(shape))[:200]]
        np.save(folder / name, moved(random_pose(i), points))
    return names


def write_pairs(path: Path, names: list[str], count: int) -> None:
    """A table of `count` pairs of these clouds; every 50th has a file that is not there."""
    random = np.random.default_rng(11)
    lines = ["id,source,target"]
    for i in range(count):
        source, target = random.choice(names, 2)
        lines.append(f"pair {i},{'missing.ply' if i % 50 == 49 else source},{target}")
    path.write_text("\n".join(lines) + "\n")


def read_rows(path: Path) -> list[Row]:
    """The rows of a file of results, typed alike in all formats; the columns are the documented."""
    if path.suffix == ".parquet":
        table = pq.read_table(path)
        assert table.column_names == COLUMNS
        return [dict(row) for row in table.to_pylist()]
    if path.suffix == ".jsonl":
        rows: list[Row] = [json.loads(line) for line in path.read_text().splitlines()]
        assert all(list(row) == COLUMNS for row in rows)
        return rows
    with path.open(newline="") as file:
        reader = csv.DictReader(file)
        assert reader.fieldnames == COLUMNS
        return [_typed(row) for row in reader]


def _typed(row: dict[str, str]) -> Row:
    numbers = {name: float(row[name]) if row[name] else None for name in COLUMNS[6:14]}
    pose = [float(number) for number in row["T_target_source"].split()]
    return {
        **row,
        **numbers,
        "row": int(row["row"]),
        "points_source": int(row["points_source"]),
        "points_target": int(row["points_target"]),
        "T_target_source": pose or None,
        "error": row["error"] or None,
    }


def without_ms(rows: list[Row]) -> list[Row]:
    """The rows without what differs from run to run."""
    return [{name: value for name, value in row.items() if name != "ms"} for row in rows]
