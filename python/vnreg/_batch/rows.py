"""The columns of the results, and the row of a pair. docs/batch.md says what they mean."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import pyarrow as pa

import vnreg
from vnreg._batch.pairs import Cloud, Pair

Row = dict[str, Any]

NAMES = ["row", "id", "source", "target"]
SCHEMA = pa.schema(
    [
        pa.field("row", pa.int64(), nullable=False),
        pa.field("id", pa.string(), nullable=False),
        pa.field("source", pa.string()),
        pa.field("target", pa.string()),
        pa.field("status", pa.string(), nullable=False),
        pa.field("T_target_source", pa.list_(pa.float64())),
        pa.field("confidence", pa.float64()),
        pa.field("overlap", pa.float64()),
        pa.field("rmse", pa.float64()),
        pa.field("inlier_distance", pa.float64()),
        pa.field("score", pa.float64()),
        pa.field("points_source", pa.int64(), nullable=False),
        pa.field("points_target", pa.int64(), nullable=False),
        pa.field("ms", pa.float64()),
        pa.field("error", pa.string()),
    ]
)


def failed_row(number: int, pair: Pair, status: str, error: str) -> Row:
    """The row of a pair that the engine has not seen."""
    return named(number, pair) | {
        "status": status,
        "points_source": 0,
        "points_target": 0,
        "error": one_line(error),
    }


def result_row(number: int, pair: Pair, result: vnreg.Result, error: str | None) -> Row:
    row = named(number, pair) | {
        "status": result.status,
        "points_source": result.points_source,
        "points_target": result.points_target,
        "ms": result.ms["total"],
        "error": error and one_line(error),
    }
    if result.has_pose:
        row["T_target_source"] = result.T_target_source.ravel().tolist()
        for name in ("confidence", "overlap", "rmse", "inlier_distance", "score"):
            value = getattr(result, name)
            row[name] = None if math.isnan(value) else value
    return row


def table_of(rows: Sequence[Row]) -> pa.Table:
    """Also says, in the file, which build computed it."""
    about = {"version": vnreg.__version__, "instruction_set": vnreg.instruction_set()}
    schema = SCHEMA.with_metadata({"vnreg": json.dumps(about)})
    return pa.Table.from_pylist(list(rows), schema=schema)


def one_line(text: str) -> str:
    """Control characters and bytes that are not UTF-8 become escapes."""
    readable = text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    return "".join(c if c >= " " and c != "\x7f" else f"\\x{ord(c):02x}" for c in readable)


def named(number: int, pair: Pair) -> Row:
    """The columns that say which pair it is."""
    return {
        "row": number,
        "id": str(number) if pair.id is None else one_line(pair.id),
        "source": _path(pair.source),
        "target": _path(pair.target),
    }


def _path(cloud: Cloud) -> str | None:
    return one_line(cloud) if isinstance(cloud, str) else None
