"""Triangle meshes: checks, welding, normalisation and area-weighted surface sampling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]


class MeshError(ValueError):
    """A mesh (or the text of one) that no surface can be sampled from; says why."""


@dataclass(frozen=True)
class Mesh:
    """Vertices (V, 3) float64 in any unit and triangles (T, 3) int64 of vertex indices."""

    vertices: Float64
    triangles: Int64


def checked_mesh(vertices: Float64, triangles: Int64) -> Mesh:
    """A mesh that has finite vertices, valid indices, some area and some extent.

    Raises MeshError otherwise.
    """
    if len(vertices) == 0 or len(triangles) == 0:
        raise MeshError(f"empty mesh: {len(vertices)} vertices, {len(triangles)} triangles")
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise MeshError(f"vertices must be (V, 3), got {vertices.shape}")
    if triangles.ndim != 2 or triangles.shape[1] != 3:
        raise MeshError(f"triangles must be (T, 3), got {triangles.shape}")
    low, high = int(triangles.min()), int(triangles.max())
    if low < 0 or high >= len(vertices):
        raise MeshError(
            f"vertex index {low if low < 0 else high} is outside 0..{len(vertices) - 1}"
        )
    used = vertices[np.unique(triangles)]
    if not np.isfinite(used).all():
        raise MeshError("a vertex that a face uses is not finite")
    mesh = Mesh(vertices, triangles)
    extent = float(np.ptp(used, axis=0).max())
    if extent <= 0 or triangle_areas(mesh).sum() <= 1e-12 * extent * extent:
        raise MeshError("the surface has no area")
    return mesh


def triangle_areas(mesh: Mesh) -> Float64:
    """Area of every triangle, (T,), in squared units of the vertices."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    areas: Float64 = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return areas


def bounding_box(mesh: Mesh) -> tuple[Float64, Float64]:
    """Lowest and highest corner, each (3,), of the vertices that triangles use."""
    used = mesh.vertices[np.unique(mesh.triangles)]
    return used.min(axis=0), used.max(axis=0)


def normalised(mesh: Mesh) -> Mesh:
    """The mesh moved to its bounding-box centre and scaled to longest side 1."""
    low, high = bounding_box(mesh)
    return Mesh((mesh.vertices - (low + high) / 2) / (high - low).max(), mesh.triangles)


def stretched_to_unit_box(mesh: Mesh) -> Mesh:
    """The mesh scaled axis by axis so that its bounding box is [-0.5, 0.5]^3.

    An axis thinner than 1 % of the longest side is left at its own proportion: stretching it
    would only blow up modelling noise.
    """
    low, high = bounding_box(mesh)
    side = high - low
    scale = np.where(side > 0.01 * side.max(), side, side.max())
    return Mesh((mesh.vertices - (low + high) / 2) / scale, mesh.triangles)


def welded(mesh: Mesh, tolerance: float = 1e-6) -> Mesh:
    """The same surface as a set: equal vertices merged, repeated triangles kept once.

    Exporters write one vertex per face corner, and both sides of thin parts as two coincident
    triangles of opposite orientation; both would spoil area weights and winding numbers.
    `tolerance` is relative to the longest side. Of repeated triangles the first one stays.
    """
    low, high = bounding_box(mesh)
    cells = np.round((mesh.vertices - low) / (tolerance * (high - low).max()))
    cells = np.clip(np.nan_to_num(cells), -1, 1 / tolerance + 1).astype(np.int64)
    width = int(1 / tolerance) + 4
    keys = ((cells[:, 0] + 1) * width + cells[:, 1] + 1) * width + cells[:, 2] + 1
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    triangles = inverse.reshape(-1)[mesh.triangles]
    ordered = np.sort(triangles, axis=1)
    solid = (ordered[:, 0] != ordered[:, 1]) & (ordered[:, 1] != ordered[:, 2])
    triangles, ordered = triangles[solid], ordered[solid]
    _, kept = np.unique(ordered, axis=0, return_index=True)
    return Mesh(mesh.vertices[first], triangles[np.sort(kept)])


def sample_surface(mesh: Mesh, count: int, rng: np.random.Generator) -> Float64:
    """`count` points (count, 3) float64 drawn uniformly by area from the surface."""
    cumulative = np.cumsum(triangle_areas(mesh))
    chosen = np.searchsorted(cumulative, rng.random(count) * cumulative[-1], side="right")
    chosen = np.minimum(chosen, len(cumulative) - 1)
    root, along = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    a, b, c = (mesh.vertices[mesh.triangles[chosen, k]] for k in range(3))
    points: Float64 = (1 - root) * a + root * (1 - along) * b + root * along * c
    return points
