"""Training pairs as hard as the world makes them: disjoint samples, crops, noise, outliers.

Both clouds of a pair are in the shape's frame (R = I), as in `resample`. Where that sampler draws
the paper's settings, this one draws two scans of one object: crops in random directions of both
clouds, different densities, points that belong to neither.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vnreg_train.data.catalog import stable_seed
from vnreg_train.data.mesh import Float32, Float64
from vnreg_train.data.protocol import random_direction
from vnreg_train.data.shapes import ShapeSet

ANISOTROPIC_CHANCE = 0.7
ANISOTROPIC_RANGE = (0.7, 1.3)
MIRROR_CHANCE = 0.5
NOISE_CLIP = 5.0  # in sigmas
UNEVENNESS = (1.0, 4.0)  # logarithm of the density ratio per unit length
OUTLIER_BOX = 0.6  # half side


@dataclass(frozen=True)
class Recipe:
    """How the clouds of a pair differ. Ranges are drawn from uniformly, per pair."""

    shared: float = 0.0  # share of the points that both clouds have
    keep: float = 1.0  # share of each cloud that its crop keeps
    sigma: tuple[float, float] = (0.0, 0.0)  # noise, in units of the longest side
    sparse: bool = False  # half the points in one of the clouds
    uneven: bool = False  # density that grows along a random direction, in both clouds
    outliers: float = 0.0  # share of the points replaced by points of a box


RECIPES = {
    "clean": Recipe(shared=1.0),
    "noisy": Recipe(shared=1.0, sigma=(0.005, 0.02)),
    "half": Recipe(shared=0.5),
    "independent": Recipe(sigma=(0.0, 0.01)),
    "partial_same": Recipe(shared=1.0, keep=0.75),
    "partial_75": Recipe(keep=0.75),
    "partial_75_noisy": Recipe(keep=0.75, sigma=(0.005, 0.02)),
    "partial_50": Recipe(keep=0.5),
    "partial_50_noisy": Recipe(keep=0.5, sigma=(0.005, 0.015)),
    "sparse": Recipe(keep=0.75, sparse=True, sigma=(0.0, 0.01)),
    "uneven": Recipe(keep=0.75, uneven=True, sigma=(0.0, 0.01)),
    "outliers": Recipe(keep=0.75, outliers=0.1, sigma=(0.0, 0.01)),
}


@dataclass(frozen=True)
class PaddedPairs:
    """B pairs. Clouds (B, N, 3) float32, their first counts (B,) points real, the others zero."""

    source: Float32
    target: Float32
    source_count: np.ndarray
    target_count: np.ndarray


class MixtureSampler:
    """Batch i is a pure function of (seed, i). points: N, the most a cloud has.

    anisotropic_batches: the first so many batches change the shapes' proportions; None: all do.
    """

    def __init__(
        self,
        shapes: ShapeSet,
        points: int,
        batch: int,
        mixture: Mapping[str, float],
        seed: int,
        anisotropic_batches: int | None = None,
    ) -> None:
        unknown = sorted(set(mixture) - set(RECIPES))
        if unknown:
            raise ValueError(f"unknown recipes {unknown}; known are {', '.join(RECIPES)}")
        weights = np.array(list(mixture.values()), dtype=np.float64)
        if not np.isfinite(weights).all() or (weights < 0).any() or weights.sum() <= 0:
            raise ValueError(f"weights of recipes must be >= 0 with a sum > 0, got {mixture}")
        if shapes.surface.shape[1] < 8 * points:
            raise ValueError(f"{8 * points} points per shape needed: uneven samples are rejections")
        self.shapes, self.points, self.batch_size, self.seed = shapes, points, batch, seed
        self._recipes = [RECIPES[name] for name in mixture]
        self._chances = weights / weights.sum()
        self._anisotropic_batches = anisotropic_batches

    def batch(self, index: int) -> PaddedPairs:
        """Batch number `index`."""
        rng = np.random.default_rng(stable_seed("mixture batch", self.seed, index))
        rows = rng.choice(len(self.shapes), self.batch_size, replace=False)
        chosen = rng.choice(len(self._recipes), self.batch_size, p=self._chances)
        end = self._anisotropic_batches
        chance = ANISOTROPIC_CHANCE if end is None or index < end else 0.0
        pairs = [
            self._pair(self.shapes.surface[row], self._recipes[recipe], chance, rng)
            for row, recipe in zip(rows, chosen, strict=True)
        ]
        sides = list(zip(*pairs, strict=True))
        counts = [np.array([len(cloud) for cloud in side]) for side in sides]
        return PaddedPairs(*(self._padded(side) for side in sides), *counts)

    def _padded(self, clouds: tuple[Float64, ...]) -> Float32:
        padded = np.zeros((len(clouds), self.points, 3), dtype=np.float32)
        for row, cloud in zip(padded, clouds, strict=True):
            row[: len(cloud)] = cloud
        return padded

    def _pair(
        self, surface: Float32, recipe: Recipe, anisotropic: float, rng: np.random.Generator
    ) -> tuple[Float64, Float64]:
        # Half of the crops keep all points they may hold, as a scanner of fixed density would not.
        fill = rng.uniform() if rng.random() < 0.5 else 0.0
        pool = int(self.points / recipe.keep**fill)
        thin = int(rng.integers(2)) if recipe.sparse else None
        sigma = rng.uniform(*recipe.sigma)
        scale = _augmentation(anisotropic, rng)
        clouds = _samples(surface, pool, recipe, rng)
        first, second = (
            _finished(
                cloud[: len(cloud) // 2] if side == thin else cloud, scale, recipe, sigma, rng
            )
            for side, cloud in enumerate(clouds)
        )
        return first, second


def _augmentation(anisotropic: float, rng: np.random.Generator) -> Float64:
    """Factor per axis (3,): random proportions, and mirror images, which are new shapes."""
    scale = np.ones(3)
    if rng.random() < anisotropic:
        scale = rng.uniform(*ANISOTROPIC_RANGE, 3)
    if rng.random() < MIRROR_CHANCE:
        scale[0] = -scale[0]
    return scale


def _samples(
    surface: Float32, pool: int, recipe: Recipe, rng: np.random.Generator
) -> tuple[Float64, Float64]:
    """Two samples (pool, 3) of one surface in random order, int(shared * pool) points in common."""
    if recipe.uneven:
        half = len(surface) // 2
        order = rng.permutation(len(surface))
        first, second = (_uneven(surface[part], pool, rng) for part in (order[:half], order[half:]))
        return first, second
    common = int(recipe.shared * pool)
    chosen = rng.choice(len(surface), 2 * pool - common, replace=False)
    points = surface[chosen].astype(np.float64)
    return points[:pool], rng.permutation(points[pool - common :])


def _uneven(candidates: Float32, count: int, rng: np.random.Generator) -> Float64:
    """`count` of the candidates, with a chance that grows along a direction (Gumbel's top k)."""
    slope = rng.uniform(*UNEVENNESS)
    keys = slope * (candidates @ random_direction(rng)) + rng.gumbel(size=len(candidates))
    return candidates[np.argpartition(keys, -count)[-count:]].astype(np.float64)


def _finished(
    cloud: Float64, scale: Float64, recipe: Recipe, sigma: float, rng: np.random.Generator
) -> Float64:
    """The cloud rescaled, cropped, made noisy, some points replaced, in random order."""
    cloud = cloud * scale
    kept = int(recipe.keep * len(cloud))
    if kept < len(cloud):
        depth = cloud @ random_direction(rng)
        cloud = cloud[np.argpartition(depth, -kept)[-kept:]]
    if sigma > 0:
        noise = rng.normal(0.0, sigma, cloud.shape)
        cloud = cloud + np.clip(noise, -NOISE_CLIP * sigma, NOISE_CLIP * sigma)
    outliers = int(recipe.outliers * len(cloud))
    cloud = rng.permutation(cloud)
    if outliers:
        cloud[:outliers] = rng.uniform(-OUTLIER_BOX, OUTLIER_BOX, (outliers, 3)) + cloud.mean(0)
        cloud = rng.permutation(cloud)
    return cloud
