"""What the exact surface says of a pose."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vnreg_train.data.mesh import Float32, Float64
from vnreg_train.evaluate.surface_evidence import LEAST_SPREAD, TOLD, Surface, evidence

NOISE = 0.01
HALF_TURN = Rotation.from_euler("z", 180, degrees=True)


def ellipsoid(rng: np.random.Generator, count: int, bump: float = 0.0) -> Float64:
    """Half turns about its axes leave it as it is, but for a bump at one end of the x axis."""
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points[:, 0] += bump * np.exp(-((1 - points[:, 0]) ** 2) / 0.02)
    return np.asarray(points * [0.5, 0.35, 0.2])


def pose_of(turn: Rotation, move: Float64) -> Float64:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn.as_matrix(), move
    return pose


def seen(rng: np.random.Generator, bump: float, truth: Float64, noise: float = NOISE) -> Float32:
    """A target: other samples of the surface at the pose, with noise."""
    points = ellipsoid(rng, 600, bump) @ truth[:3, :3].T + truth[:3, 3]
    return (points + rng.normal(scale=noise, size=points.shape)).astype(np.float32)


@settings(deadline=None, max_examples=8)
@given(seed=st.integers(0, 2**32))
def test_a_detail_tells_the_half_turn_from_the_truth(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = pose_of(Rotation.random(rng=rng), rng.uniform(-1, 1, 3))
    turned = truth @ pose_of(HALF_TURN, np.zeros(3))
    with_bump = Surface(ellipsoid(rng, 8000, 0.2).astype(np.float32))
    assert evidence(with_bump, seen(rng, 0.2, truth), truth, turned) > 2 * TOLD
    without = Surface(ellipsoid(rng, 8000).astype(np.float32))
    # Neither way: the samples of both sides of the surface differ.
    assert abs(evidence(without, seen(rng, 0.0, truth), truth, turned)) < 10


@settings(deadline=None, max_examples=8)
@given(seed=st.integers(0, 2**32))
def test_what_settles_does_not_count(seed: int) -> None:
    """4 degrees and 0.02 are what refinement mends; and no pose is better than itself."""
    rng = np.random.default_rng(seed)
    truth = pose_of(Rotation.random(rng=rng), rng.uniform(-1, 1, 3))
    surface = Surface(ellipsoid(rng, 8000, 0.2).astype(np.float32))
    target = seen(rng, 0.2, truth)
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(np.radians(4) * axis / np.linalg.norm(axis))
    near = truth @ pose_of(turn, np.full(3, 0.01))
    assert evidence(surface, target, truth, truth) == 0
    assert abs(evidence(surface, target, truth, near)) < 1
    assert evidence(surface, target, near, truth) == pytest.approx(
        -evidence(surface, target, truth, near), abs=1
    )


def test_offsets_are_heights_over_the_surface() -> None:
    rng = np.random.default_rng(0)
    plane = np.column_stack([rng.uniform(-1, 1, (5000, 2)), np.zeros(5000)]).astype(np.float32)
    points = np.column_stack([rng.uniform(-0.5, 0.5, (50, 2)), rng.uniform(-0.2, 0.2, 50)])
    np.testing.assert_allclose(
        np.abs(Surface(plane).offsets(points)), np.abs(points[:, 2]), atol=1e-6
    )


def test_points_anywhere_count_alike() -> None:
    """Outliers are as far off under both poses: they do not outvote the rest."""
    rng = np.random.default_rng(1)
    truth = pose_of(Rotation.random(rng=rng), rng.uniform(-1, 1, 3))
    surface = Surface(ellipsoid(rng, 8000, 0.2).astype(np.float32))
    target = seen(rng, 0.2, truth, noise=LEAST_SPREAD)
    middle = truth[:3, 3].astype(np.float32)
    target[:60] = middle + rng.uniform(-0.6, 0.6, (60, 3)).astype(np.float32)
    turned = truth @ pose_of(HALF_TURN, np.zeros(3))
    assert evidence(surface, target, truth, turned) > 2 * TOLD
