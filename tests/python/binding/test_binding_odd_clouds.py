"""Odd clouds by the thousand: whatever comes in, a rigid pose comes out, or why there is none."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import vnreg

Points = NDArray[np.float64]
Cloud = Callable[[np.random.Generator, int], Points]

EXAMPLES = int(os.environ.get("VNREG_FUZZ_CLOUDS", "150"))
WITH_POSE = ("ok", "low_confidence", "ambiguous", "scales_differ")
COUNT = 96


@pytest.fixture(scope="module")
def registrar() -> vnreg.Registrar:
    """The built-in model and the default mode."""
    return vnreg.Registrar(threads=1)


def check_result(result: vnreg.Result, source: Points, target: Points) -> None:
    assert result.has_pose == (result.status in WITH_POSE)
    if not (np.isfinite(source).all() and np.isfinite(target).all()):
        assert not result.has_pose
    if not result.has_pose:
        assert np.isnan(result.T_target_source).all() and np.isnan(result.confidence)
        return
    for pose in (result.T_target_source, *(a.T_target_source for a in result.alternatives)):
        rotation = pose[:3, :3]
        assert np.abs(rotation @ rotation.T - np.eye(3)).max() <= 1e-9
        assert abs(np.linalg.det(rotation) - 1) <= 1e-9
        assert np.isfinite(pose).all() and (pose[3] == (0, 0, 0, 1)).all()
    check_covariance(result.covariance)
    assert 0 <= result.overlap <= 1 and 0 <= result.confidence <= 1
    assert np.isfinite(result.rmse)


def check_covariance(covariance: Points) -> None:
    if np.isnan(covariance).all():  # beyond float64, as of clouds of size 1e200
        return
    assert (covariance == covariance.T).all()
    deviation = np.sqrt(np.diag(covariance))
    assert (deviation > 0).all()
    unit = covariance / deviation / deviation[:, None]
    assert np.linalg.eigvalsh(unit)[0] >= -1e-9


# ---- clouds ----


def body(rng: np.random.Generator, count: int) -> Points:
    """Lopsided, without a symmetry, longest side about 1."""
    v = rng.normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    bump = 1 + 0.4 * v[:, 0] * v[:, 1] + 0.3 * v[:, 2] ** 3 + 0.2 * v[:, 0]
    return v * bump[:, None] * [0.5, 0.35, 0.25]


def duplicates(rng: np.random.Generator, count: int) -> Points:
    return body(rng, max(1, count // 8))[rng.integers(0, max(1, count // 8), count)]


def collinear(rng: np.random.Generator, count: int) -> Points:
    return rng.normal(size=(count, 1)) * rng.normal(size=3) + rng.normal(size=3)


def coplanar(rng: np.random.Generator, count: int) -> Points:
    return body(rng, count) * [1, 1, 0]


def sphere(rng: np.random.Generator, count: int) -> Points:
    v = rng.normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def cube(rng: np.random.Generator, count: int) -> Points:
    points = rng.uniform(-1, 1, (count, 3))
    face = rng.integers(0, 3, count)
    points[np.arange(count), face] = np.sign(points[np.arange(count), face])
    return points


def two_far_points(rng: np.random.Generator, count: int) -> Points:
    points = body(rng, count)
    points[:2] = np.array([[1e6, 0, 0], [0, -1e6, 0]])[:count]
    return points


def two_clusters(rng: np.random.Generator, count: int) -> Points:
    return 1e-6 * body(rng, count) + rng.integers(0, 2, (count, 1))


def lattice(rng: np.random.Generator, count: int) -> Points:
    return rng.integers(0, 4, (count, 3)).astype(float)


def one_point(rng: np.random.Generator, count: int) -> Points:
    return np.tile(rng.normal(size=3), (count, 1))


def zeros(rng: np.random.Generator, count: int) -> Points:
    return np.zeros((count, 3)) * rng.choice([-1.0, 1.0], (count, 3))


def denormals(rng: np.random.Generator, count: int) -> Points:
    return 1e-310 * body(rng, count)


KINDS: list[Cloud] = [
    body,
    duplicates,
    collinear,
    coplanar,
    sphere,
    cube,
    two_far_points,
    two_clusters,
    lattice,
    one_point,
    zeros,
    denormals,
]

kinds = st.sampled_from(KINDS)
scales = st.sampled_from([1.0, 1.0, 1e-30, 1e30, 1e-150, 1e150, 1e-200, 1e3, 1e-3])
offsets = st.sampled_from([0.0, 0.0, 1.0, 1e7, -1e30])
counts = st.one_of(st.integers(0, 30), st.integers(24, 200))


@settings(max_examples=EXAMPLES, deadline=None)
@given(
    kind=kinds,
    other=st.one_of(st.none(), kinds),
    count=counts,
    scale=scales,
    other_scale=scales,
    offset=offsets,
    mirrored=st.booleans(),
    bad=st.sampled_from([None, None, None, np.nan, np.inf, -np.inf, 2e300]),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_two_clouds(
    registrar: vnreg.Registrar,
    kind: Cloud,
    other: Cloud | None,
    count: int,
    scale: float,
    other_scale: float,
    offset: float,
    mirrored: bool,
    bad: float | None,
    seed: int,
) -> None:
    rng = np.random.default_rng(seed)
    source = kind(rng, count) * scale
    if other is not None:
        target = other(rng, count) * other_scale
    else:
        target = source @ Rotation.random(rng=rng).as_matrix().T
    target = target * ([-1, 1, 1] if mirrored else 1) + offset
    if bad is not None and count > 0:
        source[rng.integers(count), rng.integers(3)] = bad
    for x, y in ((source, target), (target, source)):
        result = registrar.align(x, y)
        check_result(result, x, y)
        if bad is not None and count >= 24:
            assert result.status == "not_finite"


# ---- what is known of some of them ----


def turned(points: Points, rotation: Points, translation: Points) -> Points:
    return points @ rotation.T + translation


def error_deg(result: vnreg.Result, rotation: Points) -> float:
    turn = Rotation.from_matrix(result.T_target_source[:3, :3].T @ rotation)
    return float(np.degrees(turn.magnitude()))


@pytest.mark.parametrize("count", range(24))
def test_too_few_points(registrar: vnreg.Registrar, count: int) -> None:
    rng = np.random.default_rng(count)
    for kind in KINDS:
        few, many = kind(rng, count), body(rng, COUNT)
        assert registrar.align(few, many).status == "too_few_points"
        assert registrar.align(many, few).status == "too_few_points"


@pytest.mark.parametrize("kind", [collinear, one_point, zeros])
def test_no_rotation_is_determined(registrar: vnreg.Registrar, kind: Cloud) -> None:
    rng = np.random.default_rng(2)
    for _ in range(10):
        assert registrar.align(kind(rng, COUNT), body(rng, COUNT)).status == "degenerate"
        assert registrar.align(body(rng, COUNT), kind(rng, COUNT)).status == "degenerate"


@pytest.mark.parametrize("scale", [1e-30, 1e-3, 1.0, 1e3, 1e30])
def test_any_scale_gives_the_pose(registrar: vnreg.Registrar, scale: float) -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        source = body(rng, 300) * scale
        rotation = Rotation.random(rng=rng).as_matrix()
        result = registrar.align(source, turned(source, rotation, rng.normal(size=3) * scale))
        assert result.has_pose and error_deg(result, rotation) < 1


def test_coordinates_of_a_map(registrar: vnreg.Registrar) -> None:
    """Metres in a grid zone: ten million from the origin, an object of one metre."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        source = body(rng, 300) + [4.5e5, 1e7, 300]
        rotation = Rotation.random(rng=rng).as_matrix()
        centre = source.mean(0)
        target = turned(source - centre, rotation, centre + rng.normal(size=3))
        result = registrar.align(source, target)
        assert result.has_pose and error_deg(result, rotation) < 1
        moved = turned(source, result.T_target_source[:3, :3], result.T_target_source[:3, 3])
        assert np.abs(moved - target).max() < 0.02


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, -2, 3]])
def test_a_rotation_of_exactly_180_degrees(registrar: vnreg.Registrar, axis: list[int]) -> None:
    unit = np.array(axis) / np.linalg.norm(axis)
    rotation = 2 * np.outer(unit, unit) - np.eye(3)
    source = body(np.random.default_rng(5), 300)
    result = registrar.align(source, source @ rotation.T)
    assert result.has_pose and error_deg(result, rotation) < 1
    check_result(result, source, source)


def test_identical_clouds(registrar: vnreg.Registrar) -> None:
    source = body(np.random.default_rng(6), 300)
    result = registrar.align(source, source)
    assert result.has_pose and error_deg(result, np.eye(3)) < 0.1
    assert np.abs(result.T_target_source[:3, 3]).max() < 1e-3


@pytest.mark.parametrize("mode", ["coarse", "paper", "verified"])
def test_a_mirrored_object_is_not_answered_with_a_reflection(mode: str) -> None:
    models = os.path.join(os.path.dirname(__file__), "..", "..", "..", "models")
    model = vnreg.Model.load(os.path.join(models, "small.vnr")) if mode == "paper" else None
    registrar = vnreg.Registrar(model, mode=mode)  # type: ignore[arg-type]  # a str, not a Literal
    rng = np.random.default_rng(7)
    for _ in range(20):
        source = body(rng, 200)
        result = registrar.align(source, source * [-1, 1, 1])
        rotation = result.T_target_source[:3, :3]
        assert result.has_pose and abs(np.linalg.det(rotation) - 1) <= 1e-9


def test_the_sign_of_zero_changes_no_bit(registrar: vnreg.Registrar) -> None:
    rng = np.random.default_rng(8)
    source, target = (lattice(rng, COUNT) for _ in range(2))
    expected = registrar.align(source, target).T_target_source
    source[source == 0] = -0.0
    np.testing.assert_array_equal(registrar.align(source, target).T_target_source, expected)


@pytest.mark.parametrize("ratio", [1.0, 1.5, 2.5, 3.5, 25.4, 1000.0])
def test_clouds_of_different_scales_are_said_to_be(
    registrar: vnreg.Registrar, ratio: float
) -> None:
    source = body(np.random.default_rng(9), 300)
    for x, y in ((source, source * ratio), (source * ratio, source)):
        result = registrar.align(x, y)
        check_result(result, x, y)
        assert (result.status == "scales_differ") == (ratio > 3)


BAD = [np.nan, np.inf, -np.inf, 2e300]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("bad", BAD)
def test_a_point_that_is_no_number_is_refused_or_dropped(bad: float, dtype: type) -> None:
    rng = np.random.default_rng(10)
    source, target = body(rng, 150).astype(dtype), body(rng, 150).astype(dtype)
    dropping = vnreg.Registrar(drop_non_finite=True)
    expected = dropping.align(source, target)
    assert (expected.dropped_source, expected.dropped_target) == (0, 0)
    for place in (0, 75, 150):
        with np.errstate(over="ignore"):
            row = np.array([[0.1, 0.2, 0.3]]).astype(dtype)
            row[0, place % 3] = bad
        spoilt = np.insert(source, place, row, axis=0)
        assert vnreg.align(spoilt, target).status == "not_finite"
        assert vnreg.align(target, spoilt).status == "not_finite"
        result = dropping.align(spoilt, target)
        assert (result.dropped_source, result.dropped_target) == (1, 0)
        assert result.points_source == 150
        np.testing.assert_array_equal(result.T_target_source, expected.T_target_source)
        assert dropping.align(target, spoilt).dropped_target == 1


def test_what_is_dropped_does_not_change_the_choice_of_points() -> None:
    """More points than are used: the subsample is that of the points that are left."""
    rng = np.random.default_rng(11)
    source, target = body(rng, 3000), body(rng, 200)
    registrar = vnreg.Registrar(drop_non_finite=True, max_points=128)
    expected = registrar.align(source, target)
    spoilt = np.insert(source, [0, 7, 7, 1500, 3000], np.nan, axis=0)
    result = registrar.align(spoilt, target)
    assert result.dropped_source == 5 and result.points_source == 128
    np.testing.assert_array_equal(result.T_target_source, expected.T_target_source)
    assert registrar.prepare(spoilt).status == "ok"
    prepared = registrar.align(registrar.prepare(spoilt), target)
    assert prepared.dropped_source == 5


def test_when_too_little_is_left_that_is_said() -> None:
    points = body(np.random.default_rng(12), 40)
    points[17:] = np.nan
    result = vnreg.align(points, body(np.random.default_rng(13), 40), drop_non_finite=True)
    assert result.status == "too_few_points"
    assert (result.points_source, result.dropped_source) == (17, 23)
    all_bad = np.full((40, 3), np.inf)
    assert vnreg.align(all_bad, points, drop_non_finite=True).status == "too_few_points"
