"""Which meshes count as near-duplicates."""

import numpy as np
import pytest
from data_solids import box, joined, sphere

from vnreg_train.data.duplicates import (
    CUBE_SYMMETRIES,
    RATIO_ANY,
    distance_ratio,
    duplicate_groups,
    fingerprint,
    is_family,
)
from vnreg_train.data.mesh import Mesh


def table(legs: float = 0.45, thick: float = 0.1) -> Mesh:
    top = box((1, 1, 0.1), (0, 0, 0.95))
    feet = [
        box((thick, thick, 0.9), (x, y, 0.45)) for x in (-legs, legs) for y in (-legs, legs * 0.5)
    ]
    return joined(top, *feet, box((0.1, 0.8, 0.1), (0.3, 0, 0.3)))


def moved(mesh: Mesh, linear: np.ndarray) -> Mesh:
    return Mesh(mesh.vertices @ linear.T + [3, 2, 1], mesh.triangles)


QUARTER_TURN = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
MIRROR = np.diag([-1.0, 1, 1])
VARIANTS = {
    "same": np.eye(3),
    "larger": 7 * np.eye(3),
    "stretched": np.diag([1, 2.5, 0.6]),
    "turned": QUARTER_TURN,
    "mirrored": MIRROR,
    "lying, stretched": np.diag([1, 1, 3]) @ np.roll(np.eye(3), 1, axis=0) @ MIRROR,
}


def test_there_are_48_symmetries():
    assert len(np.unique(CUBE_SYMMETRIES.reshape(48, 9), axis=0)) == 48
    assert np.allclose(CUBE_SYMMETRIES @ CUBE_SYMMETRIES.transpose(0, 2, 1), np.eye(3))


@pytest.mark.parametrize("name", VARIANTS)
def test_variants_of_one_mesh_are_equal(name):
    one, other = fingerprint("a/one.obj", table()), moved(table(), VARIANTS[name])
    assert distance_ratio(one, fingerprint("b/two.obj", other)) < 1.12


def test_other_shapes_are_not():
    prints = [
        fingerprint("a/table.obj", table()),
        fingerprint("b/low.obj", table(legs=0.2)),
        fingerprint("c/ball.obj", sphere()),
        fingerprint("d/cube.obj", box((1, 1, 1))),
    ]
    for i, one in enumerate(prints):
        for other in prints[:i]:
            assert distance_ratio(one, other) > RATIO_ANY
    assert duplicate_groups(prints).tolist() == [0, 1, 2, 3]


def test_groups_join_over_chains_and_are_numbered_by_first_member():
    meshes = [sphere(), table(), box((1, 2, 3)), moved(table(), 2 * MIRROR), sphere(3.0)]
    prints = [fingerprint(f"{k}/{k}.obj", mesh) for k, mesh in enumerate(meshes)]
    assert duplicate_groups(prints).tolist() == [0, 1, 2, 1, 0]


def test_a_family_is_joined_at_a_larger_distance():
    near = [("x/stool-a.obj", table()), ("x/bigStool.obj", table(thick=0.16))]
    prints = [fingerprint(path, mesh) for path, mesh in near]
    assert RATIO_ANY < distance_ratio(*prints) < 1.6
    assert duplicate_groups(prints).tolist() == [0, 0]
    strangers = [fingerprint("x/this.obj", near[0][1]), fingerprint("y/that.obj", near[1][1])]
    assert duplicate_groups(strangers).tolist() == [0, 1]


def test_families():
    assert is_family("scopia/w1/window_2x3.obj", "scopia/w2/windowArched.obj")
    assert is_family("scopia/a/round-dimmer.obj", "scopia/b/squareDimmer.obj")
    assert not is_family("scopia/a/window.obj", "katorlegaz/a/window.obj")
    assert not is_family("scopia/a/bed1.obj", "scopia/a/tub1.obj")
