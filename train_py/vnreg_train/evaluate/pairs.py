"""The pairs of one row: `make_pairs("validation", "P1/noise_0.01")`, a pure function of its words.

P1, per pair: the dense samples of the shape are dealt into two halves, one a cloud, so that no
point is in both. Each half is cropped by a plane of its own random direction that leaves the
row's share of the surface, and thinned to the row's number of points (so a cropped cloud has as
many points as an uncropped one). The target is moved by a rotation uniform on SO(3) and a
translation U[-0.5, 0.5]^3. Then noise N(0, s) per coordinate, clipped to 5 s, on both clouds.
Uneven: points are kept with a weight that falls exponentially along a random direction of each
cloud, by DENSITY_RATIO from one end to the other. Outliers replace points, uniform in the
cloud's bounding box enlarged by OUTLIER_BOX about its middle. Views: in place of the crops, a
cloud shows what a random viewpoint sees of its half (`vnreg_train.data.views`); two viewpoints lie
within MAX_VIEW_ANGLE_DEG of each other. A view of few points keeps them all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from vnreg_train.data.catalog import stable_seed
from vnreg_train.data.mesh import Float64
from vnreg_train.data.protocol import MAX_TRANSLATION, Pair, make_pair, random_direction
from vnreg_train.data.shapes import ShapeSet, load_shapes
from vnreg_train.data.views import visible
from vnreg_train.evaluate.rows import ROWS, Factors, Row

SOURCE_POINTS = 1024
DENSITY_RATIO = 10.0
OUTLIER_BOX = 1.2
NOISE_CLIP = 5.0  # standard deviations
VIEW_DISTANCE = 3.0  # of a viewpoint from the middle, in longest sides of the shape
MAX_VIEW_ANGLE_DEG = 60.0  # between the two viewpoints of a pair, from the middle
SEEN_WITHIN = 0.03  # of a seen point, about twice the distance of samples; in longest sides
DATA = Path("data/furniture")


def make_pairs(
    split: str,
    row: str | Row,
    shapes: int | Sequence[int] | None = None,
    seed: int = 0,
    data: Path = DATA,
) -> list[Pair]:
    """One pair per shape of the split, ready to align.

    shapes: how many, spread evenly over the split, or their indices; None: all. The pair of a
    shape does not depend on which others are asked for. Raises ValueError, ShapesError.
    """
    chosen = ROWS[row] if isinstance(row, str) else row
    shape_set = split_shapes(split, data)
    return list(row_pairs(shape_set, chosen, shape_indices(len(shape_set), shapes), seed))


@lru_cache(maxsize=2)
def split_shapes(split: str, data: Path = DATA) -> ShapeSet:
    """The surfaces of a split; read once."""
    return load_shapes(data, split, queries=0)


def shape_indices(count: int, wanted: int | Sequence[int] | None) -> list[int]:
    """Of `count` shapes: all, `wanted` spread evenly (the list groups like by like), or those."""
    if wanted is None:
        return list(range(count))
    if isinstance(wanted, int):
        return sorted({int(i) for i in np.linspace(0, count - 1, min(wanted, count)).round()})
    return list(wanted)


def row_pairs(
    shapes: ShapeSet, row: Row, indices: Sequence[int] | None = None, seed: int = 0
) -> Iterator[Pair]:
    """The pairs of a row, one per shape of `indices` (default all)."""
    for index in range(len(shapes)) if indices is None else indices:
        if row.factors is None:
            yield make_pair(shapes, index, row.setting, row.max_angle_deg, "P0", seed)
        else:
            yield honest_pair(shapes, index, row.name, row.factors, seed)


def honest_pair(shapes: ShapeSet, index: int, name: str, factors: Factors, seed: int = 0) -> Pair:
    """The P1 pair of one shape. overlap: share of both clouds' points, outliers counted as
    outside, that lie on the part of the surface which the other cloud shows."""
    rng = np.random.default_rng(stable_seed("P1", seed, name, shapes.names[index]))
    surface = shapes.surface[index].astype(np.float64)
    halves = np.split(rng.permutation(surface), [len(surface) // 2])
    parts = _views(halves, factors.views, rng) if factors.views else _crops(halves, factors, rng)
    counts = (SOURCE_POINTS, factors.target_points)
    clouds, shared = [], 0
    for own, other, count in zip(parts, reversed(parts), counts, strict=True):
        outliers = round(factors.outliers * count)
        cloud = _thinned(own.shown, count - outliers, factors.uneven, rng)
        shared += int(other.leaves(cloud).sum())
        clouds.append(np.concatenate([cloud, _anywhere(cloud, outliers, rng)]))
    pose = uniform_pose(rng)
    moved = clouds[1] @ pose[:3, :3].T + pose[:3, 3]
    source, target = (_noisy(cloud, factors.noise, rng) for cloud in (clouds[0], moved))
    return Pair(
        source=rng.permutation(source).astype(np.float32),
        target=rng.permutation(target).astype(np.float32),
        T_target_source=pose,
        shape=index,
        name=shapes.names[index],
        setting=name,
        max_angle_deg=180.0,
        same_crop=None,
        overlap=shared / (len(source) + len(target)),
    )


def uniform_pose(rng: np.random.Generator) -> Float64:
    """A pose (4, 4): rotation uniform on SO(3), translation U[-0.5, 0.5]^3."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(rng=rng).as_matrix()
    pose[:3, 3] = rng.uniform(-MAX_TRANSLATION, MAX_TRANSLATION, 3)
    return pose


class _Part(Protocol):
    """What a cloud shows of its half of the samples: `shown` (N, 3), and which others it would."""

    shown: Float64

    def leaves(self, points: Float64) -> NDArray[np.bool_]: ...


class _Whole:
    """Shows everything."""

    def __init__(self, half: Float64) -> None:
        self.shown = half

    def leaves(self, points: Float64) -> NDArray[np.bool_]:
        """Which of the points (N, 3) stay."""
        return np.ones(len(points), bool)


class _Crop:
    """Shows the points x with <x, direction> >= limit: a share of the half."""

    def __init__(self, half: Float64, share: float, rng: np.random.Generator) -> None:
        self._direction, self._limit = random_direction(rng), -np.inf
        if share < 1:
            self._limit = float(np.quantile(half @ self._direction, 1 - share))
        self.shown = half[self.leaves(half)]

    def leaves(self, points: Float64) -> NDArray[np.bool_]:
        """Which of the points (N, 3) stay."""
        return np.asarray(points @ self._direction >= self._limit)


class _View:
    """Shows what is seen from the middle of the half along a direction (3,), VIEW_DISTANCE away."""

    def __init__(self, half: Float64, direction: Float64) -> None:
        middle = (half.max(0) + half.min(0)) / 2
        self.shown = half[visible(half, middle + VIEW_DISTANCE * direction)]
        self._tree = cKDTree(self.shown)

    def leaves(self, points: Float64) -> NDArray[np.bool_]:
        """Which of the points (N, 3) lie on the surface that is seen."""
        return np.asarray(self._tree.query(points, distance_upper_bound=SEEN_WITHIN)[0] < np.inf)


def _crops(halves: Sequence[Float64], factors: Factors, rng: np.random.Generator) -> list[_Part]:
    return [_Crop(half, factors.kept, rng) for half in halves]


def _views(halves: Sequence[Float64], views: int, rng: np.random.Generator) -> list[_Part]:
    """The first `views` halves as viewpoints within MAX_VIEW_ANGLE_DEG of each other see them."""
    direction = random_direction(rng)
    turn = rng.uniform(0, np.radians(MAX_VIEW_ANGLE_DEG))
    aside = np.cross(direction, random_direction(rng))
    aside /= np.linalg.norm(aside)
    directions = (direction, np.cos(turn) * direction + np.sin(turn) * aside)
    seen: list[_Part] = [_View(*of) for of in zip(halves[:views], directions, strict=False)]
    return seen + [_Whole(half) for half in halves[views:]]


def _thinned(points: Float64, count: int, uneven: bool, rng: np.random.Generator) -> Float64:
    """`count` of the points (N, 3) without repetition, evenly or by density; all if there are
    fewer."""
    count = min(count, len(points))
    if not uneven:
        return points[rng.choice(len(points), count, replace=False)]
    depth = points @ random_direction(rng)
    weight = DENSITY_RATIO ** ((depth - depth.min()) / np.ptp(depth))
    return points[rng.choice(len(points), count, replace=False, p=weight / weight.sum())]


def _anywhere(cloud: Float64, count: int, rng: np.random.Generator) -> Float64:
    """Points (count, 3) uniform in the enlarged bounding box of the cloud (N, 3)."""
    middle, half = (cloud.max(0) + cloud.min(0)) / 2, np.ptp(cloud, axis=0) / 2 * OUTLIER_BOX
    return np.asarray(middle + rng.uniform(-1, 1, (count, 3)) * half)


def _noisy(cloud: Float64, sigma: float, rng: np.random.Generator) -> Float64:
    if sigma == 0:
        return cloud
    noise = rng.normal(0.0, sigma, cloud.shape)
    return cloud + np.clip(noise, -NOISE_CLIP * sigma, NOISE_CLIP * sigma)
