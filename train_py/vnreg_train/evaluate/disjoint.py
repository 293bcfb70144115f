"""What the engine says of two clouds of different objects, where every pose is wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import vnreg
from vnreg_train.data.mesh import Float64
from vnreg_train.data.shapes import ShapeSet, load_shapes
from vnreg_train.evaluate.pairs import uniform_pose

POINTS = 1024
NOISE = 0.01


@dataclass(frozen=True)
class DisjointReport:
    """Confidences (N,) of poses between different objects, and how often each status came."""

    confidence: Float64
    statuses: Counter[str]

    def share_above(self, limit: float) -> float:
        """Of all pairs; a pair without a pose counts as below."""
        return float((np.nan_to_num(self.confidence) > limit).mean())


@dataclass(frozen=True)
class Answer:
    """What an engine says of one pair, and of which shape its source is."""

    result: vnreg.Result
    source_shape: int


def disjoint_answers(
    registrar: vnreg.Registrar, shapes: ShapeSet, count: int, seed: int = 0
) -> Iterator[Answer]:
    """Of `count` pairs of samples of two different shapes, noisy and turned at random."""
    for index in range(count):
        rng = np.random.default_rng([seed, index])
        first, second = (int(shape) for shape in rng.choice(len(shapes), 2, replace=False))
        source, target = (_sample(shapes, shape, rng) for shape in (first, second))
        yield Answer(registrar.align(source, target), first)


def disjoint_report(answers: Iterable[Answer]) -> DisjointReport:
    results = [answer.result for answer in answers]
    confidence = np.array([result.confidence for result in results])
    return DisjointReport(confidence, Counter(result.status for result in results))


def _sample(shapes: ShapeSet, shape: int, rng: np.random.Generator) -> Float64:
    """(POINTS, 3), turned and moved at random, with noise on every point."""
    surface = shapes.surface[shape]
    points = surface[rng.choice(len(surface), POINTS, replace=False)].astype(np.float64)
    pose = uniform_pose(rng)
    noise = rng.normal(0, NOISE, points.shape)
    return points @ pose[:3, :3].T + pose[:3, 3] + noise


def print_report(folder: Path, split: str, count: int, seed: int) -> None:
    """The figures of docs/reliability.md."""
    shapes = load_shapes(folder, split, queries=0)
    registrar = vnreg.Registrar(threads=1)
    report = disjoint_report(disjoint_answers(registrar, shapes, count, seed))
    print(f"{count} pairs of two of {len(shapes)} {split} shapes, {POINTS} points, noise {NOISE}")
    for limit in (0.5, 0.8, 0.9):
        print(f"confidence above {limit}: {100 * report.share_above(limit):.2f} %")
    print("statuses:", ", ".join(f"{name} {n}" for name, n in report.statuses.most_common()))
