"""Training batches: fresh points, crops and noise for every pair of every epoch.

Both clouds are given in the object's frame (R = I, t = 0). The encoder is exactly equivariant,
so a pose between them would change neither features nor losses; and correspondence needs no
indices: in the common frame it is distance.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vnreg_train.data.catalog import stable_seed
from vnreg_train.data.mesh import Float32, Float64, Int64
from vnreg_train.data.protocol import KEPT_SHARE, NOISE_CLIP, random_direction
from vnreg_train.data.shapes import ShapeSet

MAX_SIGMA = 0.015
SCALE_RANGE = (0.7, 1.3)
DIAGONAL = np.full(3, 3.0**-0.5)


@dataclass(frozen=True)
class TrainingSetting:
    """How two training clouds differ. shared: share of their points (pools) in common."""

    shared: float = 1.0
    partial: bool = False
    noisy: bool = False


SETTINGS = {
    "clean": TrainingSetting(),
    "noisy": TrainingSetting(noisy=True),
    "half": TrainingSetting(shared=0.5),
    "independent": TrainingSetting(shared=0.0),
    "partial": TrainingSetting(partial=True),
    "partial_independent": TrainingSetting(shared=0.0, partial=True),
    "partial_independent_noisy": TrainingSetting(shared=0.0, partial=True, noisy=True),
}


class TrainingSampler:
    """Endless batches of training pairs; batch i is a pure function of (seed, i).

    points: N per cloud, after a crop (which keeps 75 % of a pool of int(N / 0.75)). batch: B.
    settings_mix: weight of each setting of SETTINGS. queries: Q occupancy queries per pair, of
    those the shapes have; 0 for none. augment: scale each axis by U[0.7, 1.3], then back to
    longest side 1. diagonal_crops: share of the crops that are along +-(1, 1, 1), as the authors'
    code crops; the others' directions are uniform on the sphere. An epoch is every shape once, in
    random order; batches run across its end.
    """

    def __init__(
        self,
        shapes: ShapeSet,
        points: int,
        batch: int,
        settings_mix: Mapping[str, float],
        seed: int,
        queries: int = 2048,
        augment: bool = False,
        diagonal_crops: float = 0.5,
    ) -> None:
        self.shapes, self.points, self.batch_size = shapes, points, batch
        self.seed, self.augment, self.diagonal_crops = seed, augment, diagonal_crops
        self.queries = queries if shapes.queries is not None else 0
        self.next_batch = 0
        self._names, self._chances = _checked_mix(settings_mix)
        _check_counts(shapes, points, batch, self.queries, self._names)
        self._sides = np.ptp(shapes.surface, axis=1).astype(np.float64)
        self._orders: dict[int, Int64] = {}

    def __iter__(self) -> Iterator[dict[str, Float32]]:
        """Batches from where the sampler stands, without end."""
        while True:
            yield next(self)

    def __next__(self) -> dict[str, Float32]:
        batch = self.batch(self.next_batch)
        self.next_batch += 1
        return batch

    def batch(self, index: int) -> dict[str, Float32]:
        """Batch number `index`: source and target (B, N, 3) float32 in the object's frame.

        With queries also queries (B, Q, 3) and occupancies (B, Q), float32.
        """
        rng = np.random.default_rng(stable_seed("training batch", self.seed, index))
        rows = self.shape_indices(index)
        settings = rng.choice(len(self._names), self.batch_size, p=self._chances)
        made = [
            self._pair(int(row), SETTINGS[self._names[setting]], rng)
            for row, setting in zip(rows, settings, strict=True)
        ]
        return {key: np.stack([pair[key] for pair in made]) for key in made[0]}

    def shape_indices(self, index: int) -> Int64:
        """Which shapes (B,) batch number `index` holds."""
        first = index * self.batch_size
        places = range(first, first + self.batch_size)
        count = len(self.shapes)
        return np.array([self._order(p // count)[p % count] for p in places], dtype=np.int64)

    def state_dict(self) -> dict[str, Any]:
        """What restores the sequence exactly, and what it depends on."""
        return {"next_batch": self.next_batch, **self._identity()}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Go on where the other sampler stood. ValueError if it was set up differently."""
        for key, value in self._identity().items():
            if state.get(key) != value:
                raise ValueError(f"sampler state: {key} was {state.get(key)!r}, is {value!r}")
        self.next_batch = int(state["next_batch"])

    def _identity(self) -> dict[str, Any]:
        return {
            "seed": self.seed,
            "points": self.points,
            "batch": self.batch_size,
            "queries": self.queries,
            "augment": self.augment,
            "diagonal_crops": self.diagonal_crops,
            "mix": dict(zip(self._names, map(float, self._chances), strict=True)),
            "shapes": stable_seed(*self.shapes.names),
        }

    def _order(self, epoch: int) -> Int64:
        """The random order (M,) of the shapes in an epoch; the latest ones are kept."""
        if epoch not in self._orders:
            rng = np.random.default_rng(stable_seed("epoch", self.seed, epoch))
            while len(self._orders) > 3:
                del self._orders[next(iter(self._orders))]
            self._orders[epoch] = rng.permutation(len(self.shapes))
        return self._orders[epoch]

    def _pair(
        self, row: int, setting: TrainingSetting, rng: np.random.Generator
    ) -> dict[str, Float32]:
        scale = self._scale(row, rng)
        pool = int(self.points / KEPT_SHARE) if setting.partial else self.points
        clouds = _two_samples(self.shapes.surface[row], pool, setting.shared, rng)
        sigma = rng.uniform(0.0, MAX_SIGMA) if setting.noisy else 0.0
        crops = self.diagonal_crops if setting.partial else None
        source, target = (
            _finished(cloud * scale, self.points, crops, sigma, rng) for cloud in clouds
        )
        pair = {"source": source, "target": target}
        if self.queries and self.shapes.queries is not None:
            assert self.shapes.occupancies is not None
            available = self.shapes.queries.shape[1]
            chosen = rng.choice(available, self.queries, replace=False, shuffle=False)
            pair["queries"] = (self.shapes.queries[row, chosen] * scale).astype(np.float32)
            pair["occupancies"] = self.shapes.occupancies[row, chosen].astype(np.float32)
        return pair

    def _scale(self, row: int, rng: np.random.Generator) -> Float64:
        """Factor per axis (3,) that keeps the longest side at its length."""
        if not self.augment:
            return np.ones(3)
        scale = rng.uniform(*SCALE_RANGE, 3)
        side = self._sides[row]
        return np.asarray(scale * side.max() / (scale * side).max())


def _checked_mix(mix: Mapping[str, float]) -> tuple[list[str], Float64]:
    unknown = set(mix) - set(SETTINGS)
    if unknown:
        raise ValueError(f"unknown settings {sorted(unknown)}; known are {', '.join(SETTINGS)}")
    weights = np.array(list(mix.values()), dtype=np.float64)
    if not np.isfinite(weights).all() or (weights < 0).any() or weights.sum() <= 0:
        raise ValueError(f"weights of settings must be >= 0 with a sum > 0, got {dict(mix)}")
    return list(mix), weights / weights.sum()


def _check_counts(
    shapes: ShapeSet, points: int, batch: int, queries: int, names: list[str]
) -> None:
    if points < 1 or batch < 1 or len(shapes) < 1:
        raise ValueError(f"points {points}, batch {batch} and shapes {len(shapes)} must be >= 1")
    needed = 0
    for name in names:
        pool = int(points / KEPT_SHARE) if SETTINGS[name].partial else points
        needed = max(needed, _distinct(pool, SETTINGS[name].shared))
    if shapes.surface.shape[1] < needed:
        raise ValueError(f"{needed} points per shape needed, have {shapes.surface.shape[1]}")
    if shapes.queries is not None and shapes.queries.shape[1] < queries:
        raise ValueError(f"{queries} queries wanted, shapes have {shapes.queries.shape[1]}")


def _distinct(pool: int, shared: float) -> int:
    return 2 * pool - int(shared * pool)


def _two_samples(
    surface: Float32, pool: int, shared: float, rng: np.random.Generator
) -> tuple[Float64, Float64]:
    """Two samples (pool, 3) of one surface with int(shared * pool) points in common."""
    common = int(shared * pool)
    chosen = rng.choice(len(surface), _distinct(pool, shared), replace=False)
    points = surface[chosen].astype(np.float64)
    return points[:pool], points[pool - common :]


def _finished(
    cloud: Float64,
    points: int,
    diagonal_crops: float | None,
    sigma: float,
    rng: np.random.Generator,
) -> Float32:
    """The cloud cropped to `points` unless that is None, made noisy, and in random order."""
    if diagonal_crops is not None:
        depth = cloud @ _crop_direction(diagonal_crops, rng)
        cloud = cloud[np.argpartition(depth, len(cloud) - points)[len(cloud) - points :]]
    if sigma > 0:
        noise = rng.normal(0.0, sigma, cloud.shape)
        cloud = cloud + np.clip(noise, -NOISE_CLIP, NOISE_CLIP)
    return rng.permutation(cloud).astype(np.float32)


def _crop_direction(diagonal_crops: float, rng: np.random.Generator) -> Float64:
    """Along +-(1, 1, 1) in so large a share of the cases, else uniform on the sphere."""
    if rng.random() < diagonal_crops:
        return np.asarray(DIAGONAL * rng.choice([-1.0, 1.0]))
    return random_direction(rng)
