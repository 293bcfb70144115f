"""The worst pairs of a run: which answers were wrong, the surest or the farthest off first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from vnreg_train.data.protocol import Pair
from vnreg_train.evaluate.estimates import Estimate
from vnreg_train.evaluate.failure_kinds import KINDS, failure_kinds
from vnreg_train.evaluate.pairs import row_pairs, split_shapes
from vnreg_train.evaluate.rows import Row
from vnreg_train.evaluate.run import answers_path, read_answers
from vnreg_train.evaluate.scores import Scores, score
from vnreg_train.evaluate.symmetry import TRIVIAL, SymmetryGroup

Order = Literal["confidence", "error"]
ORDERS: tuple[Order, ...] = ("confidence", "error")


@dataclass(frozen=True)
class WrongAnswer:
    """A pair, what a method said of it, and how far that is from right (up to symmetry)."""

    split: str
    seed: int
    row: Row
    pair: Pair
    category: str
    estimate: Estimate
    scores: Scores  # of this one pair
    group: SymmetryGroup

    @property
    def kind(self) -> str:
        """As failure_kinds has it."""
        return KINDS[int(failure_kinds(self.scores)[0])]


def worst_pairs(
    folder: Path,
    method: str,
    rows: Sequence[Row],
    data: Path,
    groups: Mapping[str, SymmetryGroup],
    count: int,
    order: Order,
) -> list[WrongAnswer]:
    """At most `count` wrong answers of a run's folder, the worst first.

    order: by confidence (NaN counts as 0), or by rotation error up to symmetry; no pose is the
    farthest off. The pairs are made again from the split and the seed that the answers tell.
    Raises ValueError where the folder has no answers of the method to any of the rows.
    """
    found: list[WrongAnswer] = []
    read = 0
    for row in rows:
        path = answers_path(folder, method, row)
        if path.exists():
            found += _wrong_answers(path, row, data, groups)
            read += 1
    if not read:
        raise ValueError(f"{folder} has no answers of {method} to the rows asked for")
    found.sort(key=lambda wrong: _badness(wrong, order), reverse=True)
    return [_with_twin(wrong, data) for wrong in found[:count]]


def _wrong_answers(
    path: Path, row: Row, data: Path, groups: Mapping[str, SymmetryGroup]
) -> list[WrongAnswer]:
    head, known = read_answers(path)
    shapes = split_shapes(head["split"], data)
    indices = sorted(known)
    pairs = list(row_pairs(shapes, row, indices, head["seed"]))
    estimates = [known[index] for index in indices]
    scores = score(pairs, estimates, groups)
    return [
        WrongAnswer(
            head["split"],
            head["seed"],
            row,
            pairs[k],
            shapes.categories[shapes.label[pairs[k].shape]],
            estimates[k],
            scores.chosen(np.array([k])),
            groups.get(pairs[k].name, TRIVIAL),
        )
        for k in np.flatnonzero(~scores.symmetric()).tolist()
    ]


def _badness(wrong: WrongAnswer, order: Order) -> tuple[float, float]:
    error = float(wrong.scores.symmetric_rotation_deg[0])
    if wrong.estimate.T_target_source is None:
        error = float("inf")
    confidence = float(np.nan_to_num(wrong.estimate.confidence))
    return (confidence, error) if order == "confidence" else (error, confidence)


def _with_twin(wrong: WrongAnswer, data: Path) -> WrongAnswer:
    """Now that it is one of few, also told whether it is a twin."""
    groups, shapes = {wrong.pair.name: wrong.group}, split_shapes(wrong.split, data)
    return replace(wrong, scores=score([wrong.pair], [wrong.estimate], groups, shapes))
