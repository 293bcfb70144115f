"""The groups of known solids, found from their meshes and samples."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from vnreg_train.data.mesh import Mesh, normalised, sample_surface
from vnreg_train.evaluate.find_symmetries import Turn, common_centre, find_symmetry
from vnreg_train.evaluate.symmetry import SymmetryGroup

L_SHAPE = [(0, 0), (1, 0), (1, 0.3), (0.3, 0.3), (0.3, 0.7), (0, 0.7)]


def found(solid: trimesh.Trimesh, turn: Rotation | None = None) -> SymmetryGroup:
    rotation = np.eye(3) if turn is None else turn.as_matrix()
    vertices = np.asarray(solid.vertices, np.float64) @ rotation.T
    mesh = normalised(Mesh(vertices, np.asarray(solid.faces, np.int64)))
    samples = sample_surface(mesh, 8192, np.random.default_rng(0))
    return find_symmetry(mesh, samples, 1)


def extruded(outline: list[tuple[float, float]], height: float) -> trimesh.Trimesh:
    """A prism over a star-shaped outline about its first corner; only its surface counts."""
    n = len(outline)
    bottom = [(x, y, 0.0) for x, y in outline]
    top = [(x, y, height) for x, y in outline]
    faces = [(0, k, k + 1) for k in range(1, n - 1)] + [
        (n, n + k, n + k + 1) for k in range(1, n - 1)
    ]
    for k in range(n):
        faces += [(k, (k + 1) % n, n + k), ((k + 1) % n, n + (k + 1) % n, n + k)]
    return trimesh.Trimesh(bottom + top, faces, process=False)


def orders(group: SymmetryGroup) -> list[int]:
    return sorted(axis.order for axis in group.axes)


def test_a_box_has_three_half_turns() -> None:
    group = found(trimesh.creation.box((1.0, 0.6, 0.35)))
    assert orders(group) == [2, 2, 2]
    assert len(group.elements) == 4
    assert all(axis.residual < 1e-3 for axis in group.axes)


def test_a_square_prism_has_a_fourfold_axis() -> None:
    group = found(trimesh.creation.box((0.5, 0.5, 1.0)))
    assert orders(group) == [2, 2, 2, 2, 4]
    assert len(group.elements) == 8


def test_a_cube_has_twenty_four() -> None:
    group = found(trimesh.creation.box((1.0, 1.0, 1.0)))
    assert len(group.elements) == 24 and group.axis is None


def test_a_cylinder_turns_by_any_angle_and_over() -> None:
    group = found(trimesh.creation.cylinder(0.2, 1.0, sections=64))
    assert group.axis is not None and not group.sphere
    assert abs(group.axis[2]) > 0.9999
    assert len(group.elements) == 2


def test_a_cone_turns_but_not_over() -> None:
    group = found(trimesh.creation.cone(0.3, 1.0, sections=64))
    assert group.axis is not None and len(group.elements) == 1


def test_a_tilted_prism_is_found_by_its_principal_axes() -> None:
    turn = Rotation.from_euler("xyz", [20, 35, 50], degrees=True)
    group = found(trimesh.creation.box((1.0, 0.6, 0.35)), turn)
    assert len(group.elements) == 4
    axes = np.abs(np.array([axis.direction for axis in group.axes]) @ turn.as_matrix())
    np.testing.assert_allclose(np.sort(axes.max(1)), 1, atol=1e-4)


def test_a_sphere_has_every_rotation() -> None:
    assert found(trimesh.creation.icosphere(4)).sphere


def test_a_hexagonal_prism_is_not_round() -> None:
    group = found(trimesh.creation.cylinder(0.5, 0.6, sections=6))
    assert group.axis is None and max(orders(group)) == 6
    assert len(group.elements) == 12


def test_an_l_shape_has_one_half_turn_and_none_with_a_foot() -> None:
    """Through the middle of its height an L turns over only if its arms are equal."""
    assert found(extruded(L_SHAPE, 0.4)).trivial
    equal = [(0, 0), (1, 0), (1, 0.3), (0.3, 0.3), (0.3, 1), (0, 1)]
    group = found(extruded(equal, 0.4))
    assert orders(group) == [2]
    np.testing.assert_allclose(np.abs(group.axes[0].direction), [0.7071, 0.7071, 0], atol=1e-3)


@pytest.mark.parametrize(("side", "symmetric"), [(0.06, True), (0.25, False)])
def test_one_per_cent_of_the_surface_does_not_count_but_more_does(
    side: float, symmetric: bool
) -> None:
    box = trimesh.creation.box((1.0, 0.6, 0.35))
    knob = trimesh.creation.box((side, side, side))
    knob.apply_translation((0.3, 0.2, 0.175))
    assert found(trimesh.util.concatenate([box, knob])).trivial != symmetric


def test_axes_meet_in_the_common_centre() -> None:
    centre = np.array([0.3, -0.2, 0.1])
    turns = [Turn(np.eye(3)[k], centre + 0.4 * np.eye(3)[k]) for k in range(3)]
    np.testing.assert_allclose(common_centre(turns, np.zeros(3)), centre, atol=1e-5)
    foot = common_centre(turns[:1], np.zeros(3))
    np.testing.assert_allclose(foot, [0, -0.2, 0.1], atol=1e-5)
