"""Polygons with any number of corners cut into triangles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vnreg_train.data.mesh import Float64, Int64, MeshError


def triangulated(vertices: Float64, faces: Sequence[Sequence[int]]) -> Int64:
    """Triangles (T, 3) of polygons given as index lists of three or more corners.

    Convex polygons become fans; others are cut ear by ear, so that no triangle covers area
    outside the polygon. Raises MeshError for an index that does not exist.
    """
    triangles: list[Int64] = []
    sizes = np.array([len(face) for face in faces], dtype=np.int64)
    for size in np.unique(sizes):
        group = np.array([face for face in faces if len(face) == size], dtype=np.int64)
        if group.min() < 0 or group.max() >= len(vertices):
            raise MeshError(f"a face names a vertex outside 0..{len(vertices) - 1}")
        convex = _is_convex(vertices[group]) if size > 3 else np.ones(len(group), dtype=bool)
        triangles += [group[convex][:, [0, k, k + 1]] for k in range(1, size - 1)]
        triangles += [_ears(vertices, polygon) for polygon in group[~convex]]
    return np.concatenate(triangles) if triangles else np.empty((0, 3), dtype=np.int64)


def _normals(corners: Float64) -> Float64:
    """Newell normals (F, 3), of length twice the area, of polygons (F, K, 3)."""
    centred = corners - corners[:, :1]
    normals: Float64 = np.cross(centred, np.roll(centred, -1, axis=1)).sum(axis=1)
    return normals


def _is_convex(corners: Float64) -> np.ndarray:
    """Whether each polygon (F, K, 3) turns the same way at every corner, (F,) bool."""
    edge = np.roll(corners, -1, axis=1) - corners
    turn = np.cross(np.roll(edge, 1, axis=1), edge)
    normals = _normals(corners)
    sine = np.einsum("fkc,fc->fk", turn, normals)
    slack = 1e-6 * (normals**2).sum(axis=1, keepdims=True)
    convex: np.ndarray = (sine >= -slack).all(axis=1)
    return convex


def _ears(vertices: Float64, polygon: Int64) -> Int64:
    """One polygon (K,) that is not convex, cut into K - 2 triangles by ear clipping."""
    normal = _normals(vertices[polygon][None])[0]
    drop = int(np.abs(normal).argmax())
    flat = np.delete(vertices[polygon], drop, axis=1)
    if (normal[drop] < 0) != (drop == 1):
        flat = flat[:, ::-1]
    left, ears = list(range(len(polygon))), []
    while len(left) > 3:
        cut = next((k for k in range(len(left)) if _is_ear(flat, left, k)), 0)
        ears.append([left[cut - 1], left[cut], left[(cut + 1) % len(left)]])
        del left[cut]
    return polygon[np.array([*ears, left], dtype=np.int64)]


def _is_ear(flat: Float64, left: list[int], k: int) -> bool:
    """Whether corner k of what is left (counter-clockwise, (K, 2)) can be cut off."""
    a, b, c = flat[left[k - 1]], flat[left[k]], flat[left[(k + 1) % len(left)]]
    if _cross(b - a, c - b) <= 0:
        return False
    others = flat[left]
    others = others[~np.isin(np.arange(len(left)), [(k - 1) % len(left), k, (k + 1) % len(left)])]
    inside = np.ones(len(others), dtype=bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= (others != start).any(axis=1)
        inside &= _cross(end - start, (others - start).T) >= 0
    return not inside.any()


def _cross(u: Float64, v: Float64) -> Float64:
    """Z component of the cross product of u (2,) and v (2, ...)."""
    product: Float64 = u[0] * v[1] - u[1] * v[0]
    return product
