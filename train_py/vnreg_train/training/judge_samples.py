"""What the judge learns from: poses the engine proposes on pairs of a split, right or wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import vnreg
from vnreg_train.data.mesh import Float64
from vnreg_train.data.protocol import Pair
from vnreg_train.evaluate.disjoint import disjoint_answers
from vnreg_train.evaluate.pairs import row_pairs, split_shapes
from vnreg_train.evaluate.rows import ROWS
from vnreg_train.evaluate.scores import LIMITS
from vnreg_train.evaluate.symmetry import TRIVIAL, SymmetryGroup
from vnreg_train.networks.judge import POINT_INPUTS

Float16 = NDArray[np.float16]

MOST_POSES = 12  # that the engine hands to its judge
DIFFERENT_SEED = 2_000_000  # of the pairs of different shapes
KEPT_POINTS = 128  # of each cloud, of the judge's 256: more would fill the memory for nothing


@dataclass(frozen=True)
class JudgeSamples:
    """Of N pairs: the poses in the judge's hands. Where a pair has fewer, `there` is False."""

    points: Float16  # (N, 12, 256, 33): KEPT_POINTS of the source, of the target
    fit: NDArray[np.float32]  # (N, 12)
    right: NDArray[np.bool_]  # (N, 12): up to the shape's symmetry
    there: NDArray[np.bool_]  # (N, 12)

    def __len__(self) -> int:
        return len(self.fit)


def collect_samples(
    model: Path,
    split: str,
    rows: Sequence[str],
    seeds: Sequence[int],
    groups: Mapping[str, SymmetryGroup],
    data: Path,
    shapes: Sequence[int] | None = None,
    different: int = 0,
) -> JudgeSamples:
    """One pair per shape, row and seed. Shapes without an entry in `groups` count as asymmetric.

    different: so many pairs of two different shapes, too, of which no pose is right.
    """
    registrar = vnreg.Registrar(
        vnreg.Model.load(model), mode="verified", threads=1, record_stages=True
    )
    found = []
    for pair in tqdm(_pairs(split, rows, seeds, data, shapes), "poses", unit="pair"):
        registrar.align(pair.source, pair.target)
        recorded = _recorded(registrar)
        if recorded:
            points, fit, poses = recorded
            found.append((points, fit, _right(pair, poses, groups.get(pair.name, TRIVIAL))))
    answers = disjoint_answers(registrar, split_shapes(split, data), different, DIFFERENT_SEED)
    for _ in tqdm(answers, "poses of different shapes", different, unit="pair"):
        recorded = _recorded(registrar)
        if recorded:
            points, fit, _ = recorded
            found.append((points, fit, np.zeros(len(fit), bool)))
    return _padded(found)


def _recorded(registrar: vnreg.Registrar) -> tuple[Float16, Float64, Float64] | None:
    """Of the K poses of the last call: inputs (K, 256, 33), fit (K,), rows of (R | t) (K, 12)."""
    stages = registrar.stages()
    if "judge.inputs" not in stages:
        return None
    inputs = np.asarray(stages["judge.inputs"])
    fit, poses = (np.asarray(stages[f"judge.{name}"], np.float64) for name in ("fit", "poses"))
    kept = _kept(int(stages["judge.source_points"].item()), len(inputs) // len(fit))
    kept_inputs = inputs.reshape(len(fit), -1, POINT_INPUTS)[:, kept].astype(np.float16)
    return kept_inputs, fit, poses


def _pairs(
    split: str, rows: Sequence[str], seeds: Sequence[int], data: Path, shapes: Sequence[int] | None
) -> Iterator[Pair]:
    surfaces = split_shapes(split, data)
    for seed in seeds:
        for row in rows:
            yield from row_pairs(surfaces, ROWS[row], shapes, seed)


def _right(pair: Pair, poses: Float64, group: SymmetryGroup) -> NDArray[np.bool_]:
    centres = [np.asarray(c, np.float64).mean(0) for c in (pair.source, pair.target)]
    radii = [
        np.sqrt(np.square(c - m).sum(1).mean())
        for c, m in zip((pair.source, pair.target), centres, strict=True)
    ]
    right = []
    for row in poses:
        pose = np.eye(4)
        pose[:3] = row.reshape(3, 4)
        # From network coordinates to the pair's.
        pose[:3, 3] = centres[1] + max(radii) * pose[:3, 3] - pose[:3, :3] @ centres[0]
        rotation, translation = group.errors(pose, pair.T_target_source)
        right.append(rotation < LIMITS[0][0] and translation < LIMITS[0][1])
    return np.array(right, bool)


def _padded(found: Sequence[tuple[Float16, Float64, NDArray[np.bool_]]]) -> JudgeSamples:
    count = len(found)
    points = np.zeros((count, MOST_POSES, 2 * KEPT_POINTS, POINT_INPUTS), np.float16)
    fit = np.zeros((count, MOST_POSES), np.float32)
    right, there = np.zeros((2, count, MOST_POSES), bool)
    for i, (inputs, scores, correct) in enumerate(found):
        poses = len(scores)
        points[i, :poses] = inputs
        fit[i, :poses], right[i, :poses], there[i, :poses] = scores, correct, True
    return JudgeSamples(points, fit, right, there)


def _kept(source_points: int, points: int) -> NDArray[np.int_]:
    """The first KEPT_POINTS of the source, then of the target; few points count several times."""
    first = np.arange(KEPT_POINTS)
    return np.concatenate([first % source_points, source_points + first % (points - source_points)])
