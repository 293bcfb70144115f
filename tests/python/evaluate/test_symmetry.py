"""Groups of rotations, and errors up to them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vnreg_train.data.protocol import rotation_error_deg, translation_error
from vnreg_train.evaluate.symmetry import (
    SYMMETRIES,
    TRIVIAL,
    Axis,
    SymmetryGroup,
    best_turn,
    make_group,
    read_symmetries,
)
from vnreg_train.evaluate.symmetry_file import symmetries_text

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
DIAGONAL = (0.5773503, 0.5773503, 0.5773503)
ROOT = Path(__file__).resolve().parents[3]


def group(
    *axes: tuple[tuple[float, float, float], int], centre: object = (0, 0, 0)
) -> SymmetryGroup:
    return make_group(centre, [Axis(direction, order, 0.0) for direction, order in axes])


def pose(rng: np.random.Generator) -> NDArray[np.float64]:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.uniform(-1, 1, 3)
    return T


def turned(T: NDArray[np.float64], g: SymmetryGroup, R: NDArray[np.float64]) -> NDArray[np.float64]:
    """T after a rotation of the shape about the group's centre."""
    move = np.eye(4)
    move[:3, :3], move[:3, 3] = R, g.centre - R @ g.centre
    return T @ move


@pytest.mark.parametrize(
    ("axes", "size"),
    [
        ([], 1),
        ([(X, 2)], 2),
        ([(Z, 5)], 5),
        ([(X, 2), (Y, 2), (Z, 2)], 4),  # a box
        ([(Z, 4), (X, 2)], 8),  # a square prism
        ([(Z, 4), (DIAGONAL, 3)], 24),  # a cube
        ([(DIAGONAL, 3), (Z, 2)], 12),  # a tetrahedron
    ],
)
def test_axes_generate_the_group(
    axes: list[tuple[tuple[float, float, float], int]], size: int
) -> None:
    g = group(*axes)
    assert len(g.elements) == size
    assert g.trivial == (size == 1)
    for a in g.elements:
        products = g.elements @ a
        for product in products:
            assert rotation_error_deg(g.elements, product).min() < 1e-4


def test_axes_that_generate_no_small_group_are_refused() -> None:
    with pytest.raises(ValueError, match="more than 120"):
        group((Z, 5), ((0.0, 0.5, 0.8660254), 3))


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**32))
def test_poses_of_the_group_are_right(seed: int) -> None:
    rng = np.random.default_rng(seed)
    g = group((Z, 4), (X, 2), centre=rng.uniform(-0.3, 0.3, 3))
    T = pose(rng)
    for element in g.elements:
        rotation, translation = g.errors(turned(T, g, element), T)
        assert rotation < 1e-5 and translation < 1e-9
    wrong = Rotation.from_rotvec([0, 0, np.deg2rad(30)]).as_matrix()
    assert g.errors(turned(T, g, wrong), T)[0] == pytest.approx(30, abs=1e-6)


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**32), angle=st.floats(-180, 180), flip=st.booleans())
def test_any_turn_about_a_continuous_axis_is_right(seed: int, angle: float, flip: bool) -> None:
    rng = np.random.default_rng(seed)
    g = group((Z, 0), (X, 2), centre=(0.1, -0.2, 0.3))
    T = pose(rng)
    R = Rotation.from_euler("z", angle, degrees=True)
    if flip:
        R = R * Rotation.from_euler("x", 180, degrees=True)
    rotation, translation = g.errors(turned(T, g, R.as_matrix()), T)
    assert rotation < 1e-5 and translation < 1e-9
    tilt = Rotation.from_euler("x", 20, degrees=True) * R
    assert g.errors(turned(T, g, tilt.as_matrix()), T)[0] == pytest.approx(20, abs=1e-5)


def test_without_a_flip_upside_down_is_wrong() -> None:
    g = group((Z, 0))
    R = Rotation.from_euler("x", 180, degrees=True).as_matrix()
    assert g.errors(turned(np.eye(4), g, R), np.eye(4))[0] == pytest.approx(180)


def test_a_sphere_has_no_wrong_rotation_but_wrong_places() -> None:
    g = group((Z, 0), (X, 0), centre=(0.2, 0, 0))
    rng = np.random.default_rng(0)
    T = pose(rng)
    assert g.sphere and not g.trivial
    moved = turned(T, g, Rotation.random(rng=rng).as_matrix())
    moved[:3, 3] += [0, 0.3, 0]
    np.testing.assert_allclose(g.errors(moved, T), (0, 0.3), atol=1e-6)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32))
def test_the_best_turn_beats_every_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    wanted = Rotation.random(rng=rng).as_matrix()
    best = rotation_error_deg(best_turn(axis, wanted), wanted)
    turns = Rotation.from_rotvec(np.deg2rad(np.arange(0, 360, 0.5))[:, None] * axis).as_matrix()
    assert best <= rotation_error_deg(turns, wanted).min() + 1e-9


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32))
def test_symmetric_errors_never_exceed_plain_ones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    estimate, truth = pose(rng), pose(rng)
    plain = rotation_error_deg(estimate, truth)
    assert group((DIAGONAL, 3)).errors(estimate, truth)[0] <= plain + 1e-9
    same = TRIVIAL.errors(estimate, truth)
    np.testing.assert_allclose(same, (plain, translation_error(estimate, truth)))


def test_groups_survive_the_file(tmp_path: Path) -> None:
    groups = {
        "none": group(),
        "bottle": group((Y, 0), centre=(0, 0.25, 0)),
        "box": group((X, 2), (Y, 2), (Z, 2), centre=(0.5, 0, 0)),
    }
    path = tmp_path / "symmetries.json"
    path.write_text(symmetries_text(groups), encoding="utf-8")
    read = read_symmetries(path)
    assert list(read) == list(groups)
    for name, g in groups.items():
        assert read[name].axes == g.axes
        np.testing.assert_array_equal(read[name].elements, g.elements)
        np.testing.assert_array_equal(read[name].centre, g.centre)
    assert len(path.read_text(encoding="utf-8").splitlines()) == 3 + 3 + 3


def test_the_committed_list_can_be_read_and_says_how_it_was_made() -> None:
    content = json.loads((ROOT / SYMMETRIES).read_text(encoding="utf-8"))
    assert content["rebuild"] == "vnreg-train find-symmetries"
    groups = read_symmetries(ROOT / SYMMETRIES)
    assert len(groups) == 575 + 163 + 82
    assert 100 < sum(not g.trivial for g in groups.values()) < 400
    assert all(axis.residual <= 0.01 for g in groups.values() for axis in g.axes)
