"""P1 pairs: what each factor does to them, and that they are a pure function of their words."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vnreg_train.data.protocol import Pair, make_pair, rotation_error_deg
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.data.views import visible
from vnreg_train.evaluate import pairs as pairs_module
from vnreg_train.evaluate.pairs import honest_pair, make_pairs, shape_indices, uniform_pose
from vnreg_train.evaluate.rows import P1_FACTORS, ROWS, VIEW_FACTORS, Factors

Points = NDArray[np.float64]


def in_object_frame(pair: Pair) -> tuple[Points, Points]:
    """Both clouds where the shape was sampled."""
    pose = pair.T_target_source
    source, target = pair.source.astype(np.float64), pair.target.astype(np.float64)
    return source, (target - pose[:3, 3]) @ pose[:3, :3]


def rows_on(points: Points, surface: NDArray[np.float32]) -> NDArray[np.int64]:
    """Which dense sample each point is; it must be one."""
    apart, nearest = cKDTree(surface).query(points)
    assert apart.max() < 1e-6
    return np.asarray(nearest)


@settings(deadline=None, max_examples=30)
@given(index=st.integers(0, 5), seed=st.integers(0, 2**32), kept=st.sampled_from([1.0, 0.75, 0.5]))
def test_clouds_are_disjoint_samples_of_the_surface(
    shapes: ShapeSet, index: int, seed: int, kept: float
) -> None:
    pair = honest_pair(shapes, index, "row", Factors(kept=kept), seed)
    source, target = (rows_on(c, shapes.surface[index]) for c in in_object_frame(pair))
    assert len(np.unique(source)) == len(np.unique(target)) == 1024
    assert not set(source) & set(target)
    np.testing.assert_allclose(
        pair.T_target_source[:3, :3] @ pair.T_target_source[:3, :3].T, np.eye(3), atol=1e-12
    )
    assert np.abs(pair.T_target_source[:3, 3]).max() <= 0.5


@pytest.mark.parametrize("kept", [0.75, 0.5])
def test_a_crop_keeps_its_share_beyond_a_plane(shapes: ShapeSet, kept: float) -> None:
    """Some direction separates what is kept from 1 - kept of the surface (linear programming
    finds it), and the overlap is the share of both clouds beyond both planes."""
    pair = honest_pair(shapes, 0, "row", Factors(kept=kept), 3)
    surface = shapes.surface[0].astype(np.float64)
    rng = np.random.default_rng(0)
    for cloud in in_object_frame(pair):
        # The mean of the kept points leans towards the crop's direction: start there, then climb.
        direction = cloud.mean(0) / np.linalg.norm(cloud.mean(0))
        best = beyond = (surface @ direction >= (cloud @ direction).min()).mean()
        step = 0.5
        for _ in range(4000):
            trial = direction + step * rng.normal(size=3)
            trial /= np.linalg.norm(trial)
            beyond = (surface @ trial >= (cloud @ trial).min()).mean()
            if beyond < best:
                direction, best = trial, beyond
            else:
                step = max(step * 0.995, 1e-3)
        assert best == pytest.approx(kept, abs=0.03)


def test_overlap_is_one_without_crops_and_counts_outliers_out(shapes: ShapeSet) -> None:
    assert honest_pair(shapes, 1, "row", Factors(), 0).overlap == 1
    outliers = honest_pair(shapes, 1, "row", Factors(outliers=0.1), 0)
    assert outliers.overlap == pytest.approx(0.9, abs=1e-3)
    on_surface = cKDTree(shapes.surface[1]).query(in_object_frame(outliers)[0])[0] < 1e-6
    assert on_surface.sum() == 1024 - 102


def test_overlap_is_the_share_that_the_other_crop_leaves(
    shapes: ShapeSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With crops towards x and towards -x of half the surface each, nearly nothing is shared;
    towards the same side nearly everything."""
    for signs, expected in (((1, -1), 0.0), ((1, 1), 1.0)):
        directions = iter([np.array([s, 0.0, 0.0]) for s in signs])
        monkeypatch.setattr(pairs_module, "random_direction", lambda rng, d=directions: next(d))
        pair = honest_pair(shapes, 2, "row", Factors(kept=0.5), 0)
        assert pair.overlap == pytest.approx(expected, abs=0.04)


def test_noise_has_its_spread_and_its_limit(shapes: ShapeSet) -> None:
    clean = honest_pair(shapes, 0, "row", Factors(), 5)
    noisy = honest_pair(shapes, 0, "row", Factors(noise=0.02), 5)
    # The same draws up to the noise: every noisy point has its clean one near.
    for cloud, reference in zip(in_object_frame(noisy), in_object_frame(clean), strict=True):
        apart, _ = cKDTree(cloud).query(reference)
        assert apart.max() < 0.1 * np.sqrt(3)
        assert 0.005 < np.median(apart) < 0.04


def test_density_and_unevenness(shapes: ShapeSet) -> None:
    pair = honest_pair(shapes, 0, "row", Factors(target_points=512), 0)
    assert (len(pair.source), len(pair.target)) == (1024, 512)
    even, uneven = (
        np.concatenate(
            [honest_pair(shapes, 0, "r", Factors(uneven=flag), s).source.mean(0) for s in range(9)]
        )
        for flag in (False, True)
    )
    assert np.abs(uneven).max() > 3 * np.abs(even).max()  # the mean leaves the middle


def test_rotations_are_uniform() -> None:
    """The angle of a uniform rotation has density (1 - cos a) / pi: mean 126.5 degrees."""
    rng = np.random.default_rng(0)
    rotations = np.stack([uniform_pose(rng)[:3, :3] for _ in range(4000)])
    angles = rotation_error_deg(rotations, np.eye(3))
    assert angles.mean() == pytest.approx(np.degrees(np.pi / 2 + 2 / np.pi), abs=2)
    assert np.abs(rotations.mean(0)).max() < 0.05


def test_a_view_shows_one_side(shapes: ShapeSet) -> None:
    """Of a convex body seen from afar: the points whose normal looks that way, about half."""
    rng = np.random.default_rng(4)
    sphere = rng.normal(size=(6, 16384, 3))
    sphere /= 2 * np.linalg.norm(sphere, axis=2, keepdims=True)
    balls = replace(shapes, surface=sphere.astype(np.float32))
    pair = honest_pair(balls, 0, "row", Factors(views=1), 1)
    source, target = in_object_frame(pair)
    middle = source.mean(0)
    viewpoint = 3 * middle / np.linalg.norm(middle)
    # What a viewpoint at distance d sees of a ball of radius r: <x, direction> >= r^2 / d.
    depth = source @ viewpoint / 3
    assert depth.min() > 0.25 / 3 - 0.1
    assert np.abs(target.mean(0)).max() < 0.05 < np.linalg.norm(middle)
    shown = (sphere[0] @ viewpoint / 3 > 0.25 / 3).mean()
    assert pair.overlap == pytest.approx((1 + shown) / 2, abs=0.05)


def test_two_views_are_not_far_apart(shapes: ShapeSet) -> None:
    """They see nearly the same at 0 degrees, and less together at 60."""
    overlaps = [honest_pair(shapes, 1, "row", Factors(views=2), s).overlap for s in range(40)]
    assert 0.3 < min(overlaps) < 0.8 < max(overlaps) <= 1


def test_nothing_is_seen_from_within_a_plane() -> None:
    flat = np.random.default_rng(0).uniform(-1, 1, (50, 3)) * [1, 1, 0]
    with pytest.raises(ValueError, match="no view"):
        visible(flat, np.array([3.0, 0.0, 0.0]))
    with pytest.raises(ValueError, match="the viewpoint lies on a point"):
        visible(flat, flat[7])


@pytest.mark.parametrize(
    "row",
    [f"P1/{name}" for name in P1_FACTORS]
    + [f"views/{name}" for name in VIEW_FACTORS]
    + ["P0/partial/90"],
)
def test_pairs_are_a_pure_function_of_their_words(data_folder: Path, row: str) -> None:
    every = make_pairs("validation", row, data=data_folder)
    assert [pair.shape for pair in every] == list(range(6))
    assert every[0].name == "validation-a"
    some = make_pairs("validation", row, [4, 1], data=data_folder)
    for pair, same in zip(some, (every[4], every[1]), strict=True):
        np.testing.assert_array_equal(pair.source, same.source)
        np.testing.assert_array_equal(pair.target, same.target)
        np.testing.assert_array_equal(pair.T_target_source, same.T_target_source)
        assert (pair.name, pair.overlap) == (same.name, same.overlap)
    other = make_pairs("validation", row, [4], seed=1, data=data_folder)[0]
    assert not np.array_equal(other.T_target_source, every[4].T_target_source)


def test_p0_rows_are_the_papers_pairs(data_folder: Path, shapes: ShapeSet) -> None:
    pair = make_pairs("validation", "P0/noisy/45", [2], data=data_folder)[0]
    expected = make_pair(shapes, 2, "noisy", 45.0)
    np.testing.assert_array_equal(pair.source, expected.source)
    np.testing.assert_array_equal(pair.T_target_source, expected.T_target_source)


def test_rows_draw_different_pairs(shapes: ShapeSet) -> None:
    poses = [
        honest_pair(shapes, 0, row.name, row.factors).T_target_source[0, 0]
        for row in ROWS.values()
        if row.factors
    ]
    assert len(set(poses)) == len(poses)


def test_shapes_are_spread_over_the_split() -> None:
    assert shape_indices(82, 3) == [0, 40, 81]
    assert shape_indices(5, None) == shape_indices(5, 9) == [0, 1, 2, 3, 4]
    assert shape_indices(5, [3, 1]) == [3, 1]
