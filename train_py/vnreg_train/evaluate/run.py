"""Methods over rows, one file of answers for each, so that an interrupted run goes on.

FOLDER/METHOD/ROW.jsonl: the first line says what the answers depend on, every further line is the
answer to one pair. A file that depends on something else is started anew.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from vnreg_train.data.protocol import Pair
from vnreg_train.evaluate.estimates import Estimate
from vnreg_train.evaluate.methods import Method
from vnreg_train.evaluate.pairs import DATA, row_pairs, shape_indices, split_shapes
from vnreg_train.evaluate.rows import Row

PAIRS_VERSION = 1  # raised when make_pairs gives other pairs for the same words


@dataclass(frozen=True)
class Pairing:
    """Which pairs: the shapes of a split (see pairs.shape_indices), and a seed."""

    split: str
    shapes: int | None = None
    seed: int = 0
    data: Path = DATA

    def indices(self) -> list[int]:
        return shape_indices(len(split_shapes(self.split, self.data)), self.shapes)

    def pairs(self, row: Row) -> Iterator[Pair]:
        """The pairs of a row, in the order of indices()."""
        return row_pairs(split_shapes(self.split, self.data), row, self.indices(), self.seed)


def answers(
    method: Method, row: Row, pairing: Pairing, folder: Path | None = None
) -> list[Estimate]:
    """The method's answers to a row's pairs, in order; those in the folder are not made again."""
    if folder is None:
        return [method.estimate(pair) for pair in pairing.pairs(row)]
    path = answers_path(folder, method.name, row)
    head = json.dumps(_head(method, row, pairing), sort_keys=True)
    known = _known(path, head)
    if not known:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(head + "\n", encoding="utf-8")
    with path.open("a", encoding="utf-8") as file:
        for pair in pairing.pairs(row):
            if pair.shape not in known:
                known[pair.shape] = method.estimate(pair)
                line = {"shape": pair.shape, **known[pair.shape].to_json()}
                file.write(json.dumps(line) + "\n")
                file.flush()
    return [known[index] for index in pairing.indices()]


def answers_path(folder: Path, method: str, row: Row) -> Path:
    return folder / method / f"{row.name.replace('/', '_')}.jsonl"


def read_answers(path: Path) -> tuple[dict[str, Any], dict[int, Estimate]]:
    """What a file depends on, and its answers by shape; a torn last line is left out."""
    lines = path.read_text(encoding="utf-8").split("\n")
    found = {}
    for line in lines[1:-1]:
        content = json.loads(line)
        found[int(content.pop("shape"))] = Estimate.from_json(content)
    return json.loads(lines[0]), found


def _known(path: Path, head: str) -> dict[int, Estimate]:
    """Answers of a file with this head; what an interruption tore is cut off."""
    if not path.exists():
        return {}
    content = path.read_text(encoding="utf-8")
    if content.split("\n", 1)[0] != head:
        return {}
    whole = content[: content.rfind("\n") + 1]
    if whole != content:
        path.write_text(whole, encoding="utf-8")
    return read_answers(path)[1]


def _head(method: Method, row: Row, pairing: Pairing) -> dict[str, Any]:
    return {
        "method": method.identity(),
        "row": row.name,
        "factors": None if row.factors is None else asdict(row.factors),
        "split": pairing.split,
        "seed": pairing.seed,
        "pairs_version": PAIRS_VERSION,
    }


def answer_all(
    makers: Sequence[Callable[[], Method]],
    rows: Sequence[Row],
    pairing: Pairing,
    folder: Path | None = None,
    jobs: int = 1,
) -> Iterator[tuple[str, Row, list[Estimate]]]:
    """(method's name, row, answers) of every method over every row, as they come, in order.

    makers make the methods where they run: each of `jobs` processes makes its own.
    """
    if jobs == 1:
        for make in makers:
            method = make()
            yield from ((method.name, row, answers(method, row, pairing, folder)) for row in rows)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        work: Iterable[tuple[Row, Future[tuple[str, list[Estimate]]]]] = [
            (row, pool.submit(_in_process, make, row, pairing, folder))
            for make in makers
            for row in rows
        ]
        for row, future in work:
            name, estimates = future.result()
            yield name, row, estimates


_methods: dict[Any, Method] = {}


def _in_process(
    make: Callable[[], Method], row: Row, pairing: Pairing, folder: Path | None
) -> tuple[str, list[Estimate]]:
    key = repr(make)
    if key not in _methods:
        _methods[key] = make()
    method = _methods[key]
    return method.name, answers(method, row, pairing, folder)
