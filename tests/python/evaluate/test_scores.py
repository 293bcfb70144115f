"""Errors of estimates, and what the covariance promises."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vnreg_train.data.shapes import ShapeSet
from vnreg_train.evaluate.estimates import Estimate
from vnreg_train.evaluate.pairs import row_pairs
from vnreg_train.evaluate.rows import ROWS
from vnreg_train.evaluate.scores import Scores, concatenated, score, squared_error
from vnreg_train.evaluate.surface_evidence import TOLD
from vnreg_train.evaluate.symmetry import TRIVIAL, Axis, make_group

ROW = ROWS["P1/partial_75"]


def scores_of(shapes: ShapeSet, method: Any, groups: Any = None) -> Scores:
    pairs = list(row_pairs(shapes, ROW))
    return score(pairs, [method.estimate(pair) for pair in pairs], groups or {})


def test_errors_are_those_against_the_truth(shapes: ShapeSet, known_method: Any) -> None:
    found = scores_of(shapes, known_method({0: 0.0, 1: 3.0, 2: 4.99, 3: 5.01, 4: 150.0}))
    np.testing.assert_allclose(found.rotation_deg, [0, 3, 4.99, 5.01, 150, 180], atol=1e-5)
    np.testing.assert_allclose(found.translation, [0, 0, 0, 0, 0, np.inf], atol=1e-12)
    np.testing.assert_array_equal(found.plain(), [1, 1, 1, 0, 0, 0])
    np.testing.assert_array_equal(found.plain((2.0, 0.02)), [1, 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(found.symmetric(), found.plain())
    np.testing.assert_array_equal(found.ambiguous, [0, 0, 0, 1, 1, 0])
    np.testing.assert_array_equal(found.right_alternative, [1, 1, 1, 1, 1, 0])
    np.testing.assert_array_equal(np.isnan(found.nees), [0, 0, 0, 1, 1, 1])
    np.testing.assert_allclose(found.overlap, [pair.overlap for pair in row_pairs(shapes, ROW)])
    assert not found.symmetric_shape.any()


def test_poses_up_to_symmetry_are_right(shapes: ShapeSet, known_method: Any) -> None:
    """The known method errs by turning about x in the target's frame, here the shape's x too."""
    pairs = list(row_pairs(shapes, ROW, [0, 1]))
    axis = tuple(pairs[0].T_target_source[:3, :3].T @ [1.0, 0.0, 0.0])
    groups = {pairs[0].name: make_group(np.zeros(3), [Axis(axis, 2, 0.0)])}
    method = known_method({0: 178.0, 1: 178.0})
    found = score(pairs, [method.estimate(pair) for pair in pairs], groups)
    np.testing.assert_array_equal(found.plain(), [0, 0])
    np.testing.assert_array_equal(found.symmetric_shape, [1, 0])
    assert found.symmetric_rotation_deg[0] == pytest.approx(2, abs=1e-5)
    # A turn by w about the source's origin, at t, is one about the target's and a move by w x t.
    turn, apart = np.deg2rad(2) ** 2, np.linalg.norm(pairs[0].T_target_source[1:3, 3]) ** 2
    assert found.nees[0] == pytest.approx(turn * (1 + apart), rel=1e-3)
    assert np.isnan(found.nees[1])


def test_parts_can_be_joined_and_chosen(shapes: ShapeSet, known_method: Any) -> None:
    found = scores_of(shapes, known_method({0: 0.0, 1: 3.0}))
    twice = concatenated([found, found])
    assert len(twice) == 12
    chosen = twice.chosen(twice.rotation_deg < 1)
    np.testing.assert_array_equal(chosen.ms, [2.0, 2.0])


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 2**32))
def test_the_squared_error_is_six_in_the_mean(seed: int) -> None:
    """Poses drawn as the covariance says, about a truth of any rotation."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(6, 6)) * [0.005, 0.005, 0.005, 0.03, 0.03, 0.03]
    covariance = root.T @ root
    estimate = np.eye(4)
    estimate[:3, :3] = Rotation.random(rng=rng).as_matrix()
    estimate[:3, 3] = rng.uniform(-1, 1, 3)
    errors = rng.multivariate_normal(np.zeros(6), covariance, 1000)
    moves = np.tile(np.eye(4), (1000, 1, 1))
    moves[:, :3, :3] = Rotation.from_rotvec(errors[:, :3]).as_matrix()
    moves[:, :3, 3] = errors[:, 3:]
    values = [squared_error(estimate, move @ estimate, covariance) for move in moves]
    assert np.mean(values) == pytest.approx(6, abs=0.6)
    exact = np.einsum("ni,ij,nj->n", errors, np.linalg.inv(covariance), errors)
    np.testing.assert_allclose(values, exact, rtol=1e-6)


def test_a_singular_covariance_tells_nothing() -> None:
    assert np.isnan(squared_error(np.eye(4), np.eye(4), np.zeros((6, 6))))


def test_twins_are_wrong_poses_that_look_right(shapes: ShapeSet, known_method: Any) -> None:
    """6 degrees about its middle move hardly a point of a shape by 0.03, 90 degrees nearly all."""
    pairs = list(row_pairs(shapes, ROW, [0, 1, 2]))
    method = known_method({0: 0.0, 1: 6.0, 2: 90.0})
    estimates = [method.estimate(pair) for pair in pairs]
    found = score(pairs, estimates, {}, shapes)
    np.testing.assert_array_equal(found.twin, [0, 1, 0])
    # 6 degrees settle; 90 are told. A right pose is not asked about.
    np.testing.assert_array_equal(found.against < TOLD, [0, 1, 0])
    np.testing.assert_array_equal(np.isnan(found.against), [1, 0, 0])
    unasked = score(pairs, estimates, {})
    np.testing.assert_array_equal(unasked.twin, [0, 0, 0])
    assert np.isnan(unasked.against).all()


def test_pairs_without_a_pose_are_misses(shapes: ShapeSet) -> None:
    pairs = list(row_pairs(shapes, ROW, [0]))
    found = score(pairs, [Estimate(None, 1.0, "degenerate")], {pairs[0].name: TRIVIAL})
    assert found.rotation_deg[0] == found.symmetric_rotation_deg[0] == 180
    assert not found.symmetric().any()
