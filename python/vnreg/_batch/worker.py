"""What runs on the workers."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from distributed import Worker, WorkerPlugin, get_worker

import vnreg
from vnreg._batch.blocks import Block
from vnreg._batch.clouds import Points, UnreadableCloud, read_ahead
from vnreg._batch.output import OutputFolder
from vnreg._batch.pairs import Pair
from vnreg._batch.rows import Row, failed_row, result_row, table_of


class LoadedModel(WorkerPlugin):
    """A worker's model, loaded when it joins, and a Registrar for each of its threads."""

    def __init__(self, name: str, content: bytes | None, options: dict[str, Any]) -> None:
        self.name = name
        self._content = content
        self._options = options
        self._version = vnreg.__version__

    def setup(self, worker: Worker) -> None:
        """Called by Dask on every worker, also on those that join later."""
        if vnreg.__version__ != self._version:
            raise RuntimeError(
                f"{worker.address}: expected vnreg {self._version}, found {vnreg.__version__}"
            )
        self.model = load_model(self._content)
        self._of_thread = threading.local()

    def registrar(self) -> vnreg.Registrar:
        if not hasattr(self._of_thread, "registrar"):
            self._of_thread.registrar = vnreg.Registrar(self.model, threads=1, **self._options)
        registrar: vnreg.Registrar = self._of_thread.registrar
        return registrar


def load_model(content: bytes | None) -> vnreg.Model:
    """The model of a file's content, or the built-in one. Raises Error."""
    return vnreg.Model.builtin() if content is None else vnreg.Model.from_bytes(content)


@dataclass(frozen=True)
class Task:
    """How a block is done."""

    plugin: str
    output: OutputFolder
    read_attempts: int

    def align_and_commit(self, block: Block) -> Counter[str]:
        """Writes the part of a block; the numbers of its rows by status."""
        return self.commit(block, self.align(block))

    def commit(self, block: Block, rows: list[Row]) -> Counter[str]:
        self.output.commit(block.file_name, table_of(rows))
        return Counter(row["status"] for row in rows)

    def align(self, block: Block) -> list[Row]:
        loaded = get_worker().plugins[self.plugin]
        assert isinstance(loaded, LoadedModel)
        clouds = read_ahead(block.pairs, block.folder, self.read_attempts)
        return [
            align_pair(block.first_row + i, pair, points, loaded)
            for i, (pair, points) in enumerate(zip(block.pairs, clouds, strict=True))
        ]


def align_pair(
    number: int,
    pair: Pair,
    clouds: tuple[Points, Points] | UnreadableCloud,
    loaded: LoadedModel,
) -> Row:
    if isinstance(clouds, UnreadableCloud):
        return failed_row(number, pair, "unreadable", str(clouds))
    try:
        result = loaded.registrar().align(*clouds)
    except (ValueError, TypeError, MemoryError) as error:
        return failed_row(number, pair, "unreadable", str(error) or "not enough memory")
    reason = None if result.has_pose else why_no_pose(pair, clouds, result, loaded.model)
    return result_row(number, pair, result, reason)


def why_no_pose(
    pair: Pair, clouds: tuple[Points, Points], result: vnreg.Result, model: vnreg.Model
) -> str:
    """Says which cloud is to blame for a result without a pose."""
    names = [x if isinstance(x, str) else word for x, word in _with_words(pair)]
    for name, points in zip(names, clouds, strict=True):
        bad = ~np.isfinite(points).all(axis=1)
        if result.status == "not_finite" and bad.any():
            at = int(bad.argmax())
            values = " ".join(f"{value:g}" for value in points[at])
            return f"{name}: point {at + 1}: expected finite coordinates, found {values}"
        if result.status == "too_few_points" and (~bad).sum() < model.min_points:
            return f"{name}: expected at least {model.min_points} points, found {(~bad).sum()}"
    return (
        f"{names[0]} and {names[1]}: expected clouds that determine a rotation, "
        f"found status {result.status}"
    )


def _with_words(pair: Pair) -> Iterable[tuple[Any, str]]:
    return ((pair.source, "source"), (pair.target, "target"))
