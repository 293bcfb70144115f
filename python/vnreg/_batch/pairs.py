"""The pairs of any input, one after the other."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Any, NamedTuple, TypeAlias

import fsspec
import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.dataset
from numpy.typing import NDArray

from vnreg._clouds import points_of

Cloud: TypeAlias = str | NDArray[Any] | None
"""A path or URL, points (N, 3), or nothing where a table has no value."""

COLUMNS = ("source", "target", "id")
TABLE_ROWS = 4096
"""Rows of a table that are read at a time."""


class Pair(NamedTuple):
    source: Cloud
    target: Cloud
    id: str | None


def read_pairs(pairs: Any, compute: Callable[[Any], Any]) -> Iterator[Pair]:
    """The pairs of what batch() is given; `compute` makes a pandas frame of a Dask partition."""
    if isinstance(pairs, str | os.PathLike):
        rows = _table_rows(os.fspath(pairs))
    elif hasattr(pairs, "npartitions"):
        chosen = pairs[_chosen(pairs.columns)]
        rows = chain.from_iterable(_frame_rows(compute(part)) for part in chosen.partitions)
    elif hasattr(pairs, "columns"):
        rows = _frame_rows(pairs)
    else:
        rows = iter(pairs)
    for number, row in enumerate(rows):
        yield _pair(number, row)


def folder_of(pairs: Any) -> str:
    """Where relative paths begin: the folder of a table's file, else the current one."""
    if not isinstance(pairs, str | os.PathLike):
        return os.getcwd()
    files, path = fsspec.url_to_fs(os.fspath(pairs))
    folder = path if files.isdir(path) else path.rpartition("/")[0]
    return str(files.unstrip_protocol(folder)) if "://" in os.fspath(pairs) else folder


def _pair(number: int, row: Any) -> Pair:
    if isinstance(row, str) or len(row) not in (2, 3):
        raise ValueError(f"pairs[{number}]: expected a source, a target and perhaps an id")
    try:
        return Pair(_cloud(row[0]), _cloud(row[1]), _text(row[2]) if len(row) == 3 else None)
    except (TypeError, ValueError) as error:
        raise ValueError(f"pairs[{number}]: expected paths or clouds: {error}") from None


def _cloud(value: Any) -> Cloud:
    if isinstance(value, str | bytes | os.PathLike):
        return os.fsdecode(value)
    if _is_missing(value):
        return None
    points = np.asarray(points_of(value))
    if points.dtype == object:
        raise TypeError(f"got {type(value).__name__}")
    return points


def _text(value: Any) -> str | None:
    if isinstance(value, bytes):
        return os.fsdecode(value)
    return None if _is_missing(value) else str(value)


def _is_missing(value: Any) -> bool:
    return value is None or (np.ndim(value) == 0 and bool(value != value))


def _chosen(columns: Iterable[str]) -> list[str]:
    """Those of COLUMNS that a table has."""
    found = [name for name in COLUMNS if name in list(columns)]
    if found[:2] != ["source", "target"]:
        raise ValueError(f"pairs: expected columns source and target, got {', '.join(columns)}")
    return found


def _frame_rows(frame: Any) -> Iterator[tuple[Any, ...]]:
    return zip(*(frame[name] for name in _chosen(frame.columns)), strict=True)


def _table_rows(url: str) -> Iterator[tuple[Any, ...]]:
    batches = _csv_batches(url) if re.search(r"\.csv(\.\w+)?$", url) else _parquet_batches(url)
    return chain.from_iterable(
        zip(*(c.to_pylist() for c in batch.columns), strict=True) for batch in batches
    )


def _parquet_batches(url: str) -> Iterator[pa.RecordBatch]:
    files, path = fsspec.url_to_fs(url)
    paths = sorted(files.find(path), key=_by_number) if files.isdir(path) else [path]
    data = [name for name in paths if name.endswith(".parquet")] or paths
    table = pyarrow.dataset.dataset(data, filesystem=files, format="parquet")
    columns = _chosen(table.schema.names)
    batches: Iterator[pa.RecordBatch] = table.to_batches(
        columns=columns, batch_size=TABLE_ROWS, batch_readahead=1, fragment_readahead=1
    )
    return batches


def _by_number(path: str) -> list[tuple[int, str]]:
    """Sorts part.2 before part.10."""
    return [(int(digits or 0), rest) for digits, rest in re.findall(r"(\d*)(\D*)", path)]


def _csv_batches(url: str) -> Iterator[pa.RecordBatch]:
    """With a header that names the columns; without one, the first two columns. Values are bytes,
    because the names of files need not be UTF-8."""
    with fsspec.open(url, "rb", compression="infer") as file:
        header = file.readline().decode("utf-8-sig", "replace")
    if not header:
        return
    names = [name.strip().strip('"') for name in header.strip().split(",")]
    has_header = {"source", "target"} <= set(names)
    columns = _chosen(names) if has_header else ["f0", "f1"]
    with fsspec.open(url, "rb", compression="infer") as file:
        yield from pyarrow.csv.open_csv(
            file,
            pyarrow.csv.ReadOptions(autogenerate_column_names=not has_header, use_threads=False),
            convert_options=pyarrow.csv.ConvertOptions(
                include_columns=columns,
                column_types=dict.fromkeys(columns, pa.binary()),
                null_values=[""],
                strings_can_be_null=True,
            ),
        )
