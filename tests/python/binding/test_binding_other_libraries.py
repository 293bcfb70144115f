"""Clouds and meshes of Open3D and trimesh go in as they are."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import trimesh

import vnreg
from vnreg._clouds import SURFACE_POINTS, points_of, surface_points

o3d = pytest.importorskip("open3d", reason="only `make evaluate` installs the peers")


@pytest.fixture(scope="module")
def box() -> trimesh.Trimesh:
    return trimesh.creation.box((1.0, 0.6, 0.3))


def clouds(points: Any) -> dict[str, Any]:
    legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    return {
        "open3d": legacy,
        "open3d.t": o3d.t.geometry.PointCloud(o3d.core.Tensor(points)),
        "trimesh": trimesh.PointCloud(points),
    }


@pytest.mark.parametrize("kind", ["open3d", "open3d.t", "trimesh"])
def test_clouds_give_the_pose_of_their_points(kind: str, model: vnreg.Model, pair: Any) -> None:
    expected = vnreg.align(pair.source, pair.target, model=model)
    cloud = clouds(pair.source)[kind]
    result = vnreg.align(cloud, pair.target, model=model)
    np.testing.assert_array_equal(result.T_target_source, expected.T_target_source)
    prepared = vnreg.Registrar(model).prepare(cloud)
    assert len(prepared) == 300


def test_points_of_open3d_and_trimesh_are_shared_not_copied(pair: Any) -> None:
    cloud = clouds(pair.source)["open3d"]
    assert np.shares_memory(points_of(cloud), np.asarray(cloud.points))
    cloud = clouds(pair.source)["trimesh"]
    assert np.shares_memory(points_of(cloud), cloud.vertices)


def test_meshes_of_all_kinds_give_the_same_points_of_their_surface(box: trimesh.Trimesh) -> None:
    legacy = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(box.vertices), o3d.utility.Vector3iVector(box.faces)
    )
    meshes = [box, legacy, o3d.t.geometry.TriangleMesh.from_legacy(legacy)]
    expected = points_of(box)
    assert expected.shape == (SURFACE_POINTS, 3)
    for mesh in meshes:
        np.testing.assert_allclose(points_of(mesh), expected, atol=1e-6)
        assert vnreg.align(mesh, expected).has_pose


def test_surface_points_lie_evenly_on_the_surface(box: trimesh.Trimesh) -> None:
    points = surface_points(box.vertices, box.faces, count=20_000)
    half = np.array([0.5, 0.3, 0.15])
    on_face = np.isclose(np.abs(points), half, atol=1e-12)
    assert on_face.any(axis=1).all()
    share = on_face.mean(axis=0)
    areas = np.array([0.6 * 0.3, 1.0 * 0.3, 1.0 * 0.6])
    np.testing.assert_allclose(share, areas / areas.sum(), atol=0.015)
    assert np.abs(points.mean(axis=0)).max() < 0.01


def test_a_mesh_without_a_surface_is_refused(pair: Any) -> None:
    flat = trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False)
    with pytest.raises(ValueError, match="expected triangles with an area"):
        vnreg.align(flat, pair.target)


def test_neither_library_is_imported() -> None:
    script = (
        "import sys, numpy as np, vnreg\n"
        "class Cloud: points = np.random.default_rng(0).normal(size=(50, 3))\n"
        "assert vnreg.align(Cloud(), Cloud()).has_pose\n"
        "assert not {'open3d', 'trimesh'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
