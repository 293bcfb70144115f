"""Points of files, and of the objects that other libraries keep clouds and meshes in.

Those are recognised by what they have, so that none of those libraries is imported.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vnreg._vnreg import parse_cloud

SURFACE_POINTS = 8192
"""Points drawn from the surface of a mesh."""


def read_cloud(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """The points (N, 3) of a file, of any format that parse_cloud knows.

    Raises OSError where it cannot be read, ValueError where its content is wrong.
    """
    path = Path(path)
    try:
        return parse_cloud(path.read_bytes(), path.suffix)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def points_of(cloud: Any) -> Any:
    """(N, 3) array of the cloud's points, or of its surface; anything unknown as it is.

    Open3D: geometry.PointCloud and TriangleMesh, and those of open3d.t.geometry. trimesh:
    PointCloud and Trimesh. Points are not copied where the library shares its memory.
    """
    if hasattr(cloud, "__array__") or isinstance(cloud, list | tuple | str | bytes):
        return cloud
    if hasattr(cloud, "faces") and hasattr(cloud, "vertices"):  # trimesh.Trimesh
        return surface_points(np.asarray(cloud.vertices), np.asarray(cloud.faces))
    if hasattr(cloud, "triangles") and hasattr(cloud, "vertices"):  # open3d.geometry.TriangleMesh
        return surface_points(np.asarray(cloud.vertices), np.asarray(cloud.triangles))
    if hasattr(cloud, "triangle") and hasattr(cloud, "vertex"):  # open3d.t.geometry.TriangleMesh
        return surface_points(
            cloud.vertex.positions.cpu().numpy(), cloud.triangle.indices.cpu().numpy()
        )
    if hasattr(cloud, "vertices"):  # trimesh.PointCloud
        return np.asarray(cloud.vertices)
    if hasattr(cloud, "points"):  # open3d.geometry.PointCloud
        return np.asarray(cloud.points)
    if hasattr(cloud, "point") and hasattr(cloud.point, "positions"):  # open3d.t.geometry
        return cloud.point.positions.cpu().numpy()
    return cloud


def surface_points(
    vertices: NDArray[Any], triangles: NDArray[Any], count: int = SURFACE_POINTS, seed: int = 0
) -> NDArray[np.float64]:
    """(count, 3) points spread evenly at random over the triangles (M, 3); the same each time.

    Raises ValueError when there is no triangle with an area.
    """
    corners = np.asarray(vertices, np.float64)[np.asarray(triangles, np.int64).reshape(-1, 3)]
    edges = corners[:, 1:] - corners[:, :1]  # (M, 2, 3)
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    if not areas.sum() > 0:
        raise ValueError("mesh: expected triangles with an area, got none")
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(areas), size=count, p=areas / areas.sum())
    # Uniform in the parallelogram; what lies in its other half is reflected into the triangle.
    uv = rng.random((count, 2))
    uv[uv.sum(axis=1) > 1] = 1 - uv[uv.sum(axis=1) > 1]
    return corners[chosen, 0] + np.einsum("nk,nkd->nd", uv, edges[chosen])
