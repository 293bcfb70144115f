"""Pairs as hard as the world makes them: repeatable, and each recipe does what its name says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from vnreg_train.data.mixture import RECIPES, MixtureSampler, PaddedPairs
from vnreg_train.data.shapes import ShapeSet

N = 64


@pytest.fixture(scope="module")
def spheres() -> ShapeSet:
    rng = np.random.default_rng(0)
    surface = rng.normal(size=(20, 16 * N, 3))
    surface *= 0.5 / np.linalg.norm(surface, axis=2, keepdims=True)
    return ShapeSet(
        surface=surface.astype(np.float32),
        label=np.zeros(20, dtype=np.int64),
        names=tuple(f"sphere{i}" for i in range(20)),
        categories=("sphere",),
    )


def batch(shapes: ShapeSet, recipe: str, index: int = 0) -> PaddedPairs:
    return MixtureSampler(shapes, N, 16, {recipe: 1.0}, seed=3).batch(index)


def clouds(pairs: PaddedPairs) -> list[tuple[np.ndarray, np.ndarray]]:
    counts = zip(pairs.source_count, pairs.target_count, strict=True)
    return [(pairs.source[i, :a], pairs.target[i, :b]) for i, (a, b) in enumerate(counts)]


def common(source: np.ndarray, target: np.ndarray) -> int:
    distance, _ = cKDTree(target).query(source)
    return int((distance < 1e-6).sum())


def test_a_batch_is_a_function_of_seed_and_number(spheres: ShapeSet) -> None:
    mixture = dict.fromkeys(RECIPES, 1.0)
    first, again = (MixtureSampler(spheres, N, 8, mixture, 1).batch(4) for _ in range(2))
    assert np.array_equal(first.source, again.source)
    other = MixtureSampler(spheres, N, 8, mixture, 2).batch(4)
    assert not np.array_equal(first.source, other.source)


@pytest.mark.parametrize("recipe", RECIPES)
def test_padding_is_zero_and_points_are_not(spheres: ShapeSet, recipe: str) -> None:
    pairs = batch(spheres, recipe)
    for side, counts in ((pairs.source, pairs.source_count), (pairs.target, pairs.target_count)):
        assert side.shape == (16, N, 3) and side.dtype == np.float32
        for cloud, count in zip(side, counts, strict=True):
            assert N * 3 // 8 <= count <= N
            assert (cloud[count:] == 0).all() and (np.abs(cloud[:count]).sum(1) > 0).all()


@pytest.mark.parametrize(("recipe", "shared"), [("clean", 1.0), ("half", 0.5), ("independent", 0)])
def test_clouds_share_as_many_points_as_the_recipe_says(
    spheres: ShapeSet, recipe: str, shared: float
) -> None:
    quiet = {recipe: 1.0}
    for source, target in clouds(MixtureSampler(spheres, N, 16, quiet, 3).batch(0)):
        assert common(source, target) == int(shared * N)


def test_crops_of_the_same_points_share_some_and_not_all(spheres: ShapeSet) -> None:
    shares = [common(*pair) / len(pair[0]) for pair in clouds(batch(spheres, "partial_same"))]
    assert min(shares) > 0.6 and min(shares) < 0.9  # 2/3 at least, by the counts


def test_crops_keep_their_share_of_a_full_cloud_or_fill_it(spheres: ShapeSet) -> None:
    counts = np.concatenate([batch(spheres, "partial_50", i).source_count for i in range(4)])
    assert counts.min() == N // 2 and counts.max() > 0.8 * N


def test_a_sparse_cloud_has_half_the_points_of_the_other(spheres: ShapeSet) -> None:
    pairs = batch(spheres, "sparse")
    ratio = pairs.source_count / pairs.target_count
    assert np.allclose(np.minimum(ratio, 1 / ratio), 0.5, atol=0.02)
    assert (ratio < 1).any() and (ratio > 1).any()


def radius_spread(pairs: PaddedPairs) -> float:
    """How far points are from ellipsoids: on average, off the unit sphere of their own scaling."""
    return float(
        np.mean([np.abs(np.linalg.norm(s, axis=1) - 0.5).mean() for s, _ in clouds(pairs)])
    )


def test_noise_and_outliers_leave_the_surface(
    spheres: ShapeSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vnreg_train.data.mixture.ANISOTROPIC_CHANCE", 0.0)
    assert radius_spread(batch(spheres, "independent")) < 0.01
    assert 0.003 < radius_spread(batch(spheres, "noisy")) < 0.02
    outliers = [np.linalg.norm(s, axis=1) for s, _ in clouds(batch(spheres, "outliers"))]
    far = np.mean([np.mean(np.abs(radius - 0.5) > 0.06) for radius in outliers])
    assert 0.05 < far < 0.1


def test_uneven_clouds_are_denser_on_one_side(spheres: ShapeSet) -> None:
    def imbalance(recipe: str) -> float:
        sources = [s for i in range(3) for s, _ in clouds(batch(spheres, recipe, i))]
        return float(np.mean([np.linalg.norm(s.mean(0)) for s in sources]))

    monotone = replace(RECIPES["uneven"], keep=1.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(RECIPES, "uneven", monotone)
        assert imbalance("uneven") > 1.5 * imbalance("independent")


def test_what_cannot_be_is_refused(spheres: ShapeSet) -> None:
    with pytest.raises(ValueError, match="nonsense"):
        MixtureSampler(spheres, N, 4, {"nonsense": 1.0}, 0)
    with pytest.raises(ValueError, match="sum > 0"):
        MixtureSampler(spheres, N, 4, {"clean": 0.0}, 0)
    with pytest.raises(ValueError, match="per shape"):
        MixtureSampler(spheres, 16 * N, 4, {"clean": 1.0}, 0)


def test_the_last_batches_leave_the_proportions_as_they_are(spheres: ShapeSet) -> None:
    sampler = MixtureSampler(spheres, N, 8, {"clean": 1.0}, 0, anisotropic_batches=1)
    first, later = (
        np.array([np.abs(np.linalg.norm(s, axis=1) - 0.5).max() for s, _ in clouds(made)])
        for made in (sampler.batch(0), sampler.batch(1))
    )
    assert (first > 0.01).any() and (later < 1e-5).all()
