"""Exact properties of the network, through the engine."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from parity_pairs import (
    Points,
    cloud_without_ties,
    make_test_pair,
    normalised_error,
    rotation_difference_deg,
)
from parity_twin import Twin
from scipy.spatial.transform import Rotation

import vnreg
from vnreg_train.data.protocol import pairs, rotation_error_deg, translation_error
from vnreg_train.data.shapes import ShapeSet

LIMIT = 1e-4
OBJECT_SIZE = 1.0
FAR = 100 * OBJECT_SIZE
MODELS = ["shipped", "paper", "narrow"]
INVARIANT = ("descriptor", "significance")
EQUIVARIANT = ("global", "network0.block2", "network2.block1", "frame")


def moved(points: Points, rng: np.random.Generator) -> tuple[Points, Points]:
    """The points at a random pose up to FAR from the origin, and its rotation."""
    rotation = Rotation.random(rng=rng).as_matrix()
    direction = rng.normal(size=3)
    offset = direction / np.linalg.norm(direction) * rng.uniform(0, FAR)
    return points @ rotation.T + offset, rotation


@pytest.mark.parametrize("size", [100, 333, 1024])
@pytest.mark.parametrize("name", MODELS)
def test_features_turn_with_the_cloud_or_not_at_all(
    name: str, size: int, twin: Callable[[str], Twin]
) -> None:
    model = twin(name)
    points = cloud_without_ties(1, size, model.network.config.neighbours)
    rng = np.random.default_rng([5, size])
    for _ in range(5):
        turned, rotation = moved(points, rng)
        stages = model.engine(points, turned)
        for stage in EQUIVARIANT:
            expected = stages[f"source.{stage}"] @ rotation.T
            assert normalised_error(stages[f"target.{stage}"], expected) <= LIMIT, stage
        for stage in INVARIANT:
            error = normalised_error(stages[f"target.{stage}"], stages[f"source.{stage}"])
            assert error <= LIMIT, stage
        assert rotation_difference_deg(stages["coarse.T"], rotation) < 0.01


@pytest.mark.parametrize("name", MODELS)
def test_the_order_of_the_points_changes_rounding_only(
    name: str, twin: Callable[[str], Twin]
) -> None:
    model = twin(name)
    for seed in range(3):
        pair = make_test_pair(seed, 333, 250, noisy=True)
        rng = np.random.default_rng(seed)
        order_x, order_y = rng.permutation(333), rng.permutation(250)
        straight = model.engine(pair.source, pair.target)
        shuffled = model.engine(pair.source[order_x], pair.target[order_y])
        for side, order in (("source", order_x), ("target", order_y)):
            for stage in ("points", "edge", "network2.block1", "frame", *INVARIANT):
                expected = straight[f"{side}.{stage}"][order]
                assert normalised_error(shuffled[f"{side}.{stage}"], expected) <= LIMIT, stage
            glob = f"{side}.global"
            assert normalised_error(shuffled[glob], straight[glob]) <= LIMIT
        coarse = (shuffled["coarse.T"], straight["coarse.T"])
        assert rotation_difference_deg(*coarse) < 0.01


@pytest.mark.parametrize("unit", [1e-6, 1e-3, 25.4, 1e6])
def test_the_unit_of_length_does_not_matter(unit: float, twin: Callable[[str], Twin]) -> None:
    """With input.rms_radius set, as in the shipped model, both clouds are brought to one scale."""
    model = twin("shipped")
    assert model.network.config.input_rms_radius > 0
    pair = make_test_pair(1, 333, 250, noisy=True)
    expected = model.engine(pair.source, pair.target)["T_target_source"]
    actual = model.engine(pair.source * unit, pair.target * unit)["T_target_source"]
    assert rotation_difference_deg(actual, expected) < 0.01
    np.testing.assert_allclose(actual[:3, 3] / unit, expected[:3, 3], atol=1e-5)


@pytest.mark.furniture
def test_clean_pairs_of_the_whole_test_split_are_all_registered(
    twin: Callable[[str], Twin], furniture_test: ShapeSet
) -> None:
    """Protocol P0, Euler angles up to 180 degrees: recall 100 %, coarse alone and coarse + fine."""
    model = vnreg.Model.load(twin("shipped").path)
    registrar = vnreg.Registrar(model, mode="paper", threads=1)
    errors = []
    for pair in pairs(furniture_test, "clean", 180.0):
        result = registrar.align(pair.source, pair.target)
        for pose in (result.T_target_source_coarse, result.T_target_source):
            truth = pair.T_target_source
            errors.append((rotation_error_deg(pose, truth), translation_error(pose, truth)))
    assert len(errors) == 2 * len(furniture_test) > 200
    rotation_deg, translation = np.array(errors).T
    wrong = (rotation_deg >= 5) | (translation >= 0.2)
    assert not wrong.any(), np.flatnonzero(wrong)
