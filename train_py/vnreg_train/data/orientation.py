"""Consistent outward orientation of meshes whose triangles face anywhere.

After Takayama, Jacobson, Kavan, Sorkine-Hornung: "A simple method for correcting facet
orientations in polygon meshes based on ray casting", 2014, with fixed seeds and a rule of its own
for patches that no ray from outside reaches.
"""

from __future__ import annotations

from dataclasses import dataclass

import igl
import igl.embree
import numpy as np
from numpy.typing import NDArray

from vnreg_train.data.mesh import Float64, Int64, Mesh, triangle_areas

RAYS_PER_PATCH = 24
RAYS_BY_AREA = 1_500
RAYS_LIMIT = 20_000
RAY_START = 1e-4
CONSISTENT_SHARE = 0.9


@dataclass(frozen=True)
class _Patches:
    """Mesh with every patch turned consistently, as most of its area was; patch of triangles.

    consistent: (K,) whether at least 90 % of the patch's area was so already.
    """

    mesh: Mesh
    patch: Int64
    areas: Float64
    consistent: NDArray[np.bool_]


def oriented_outward(mesh: Mesh, seed: int = 0) -> Mesh:
    """The normalised, welded mesh with every patch facing the outside; a closed patch outward.

    Patches are triangles connected over edges of exactly two. From random points of a patch rays
    leave on both sides; the side from which more of them escape is the outside. A patch from
    which none escapes (a hidden part, or the wall of a cavity) keeps its given orientation,
    relative to what most of the visible area needed, if it was consistent in itself; else the
    side from which rays fly further is the outside.
    """
    parts = _consistent_patches(mesh)
    escaped, flown = _cast_rays(parts, np.random.default_rng(seed))
    visible = escaped.sum(axis=0) > 0
    flip = escaped[0] < escaped[1]
    turned = parts.areas @ (visible & flip) > parts.areas @ (visible & ~flip)
    hidden_flip = np.where(parts.consistent, turned, flown[0] < flown[1])
    flip = np.where(visible, flip, hidden_flip)
    triangles = parts.mesh.triangles.copy()
    triangles[flip[parts.patch]] = triangles[flip[parts.patch]][:, ::-1]
    return Mesh(mesh.vertices, triangles)


def _consistent_patches(mesh: Mesh) -> _Patches:
    turned, patch = igl.bfs_orient(mesh.triangles)
    patch = np.asarray(patch, dtype=np.int64)
    face_areas = triangle_areas(mesh)
    areas: Float64 = np.bincount(patch, face_areas).astype(np.float64)
    same = _same_direction(mesh.triangles, turned)
    kept_share = np.bincount(patch, face_areas * same) / np.maximum(areas, 1e-300)
    triangles = np.where((kept_share >= 0.5)[patch][:, None], turned, turned[:, ::-1])
    consistent = np.maximum(kept_share, 1 - kept_share) >= CONSISTENT_SHARE
    return _Patches(Mesh(mesh.vertices, triangles.astype(np.int64)), patch, areas, consistent)


def _same_direction(triangles: Int64, others: Int64) -> NDArray[np.bool_]:
    """Whether triangles of equal corner sets run through them in the same direction."""
    same = np.zeros(len(triangles), dtype=bool)
    for shift in range(3):
        same |= (np.roll(others, shift, axis=1) == triangles).all(axis=1)
    return same


def _cast_rays(parts: _Patches, rng: np.random.Generator) -> tuple[Float64, Float64]:
    """How often rays escape, and how far the others fly on average, each (front/back, patch)."""
    mesh, patches = parts.mesh, len(parts.areas)
    faces = _ray_faces(parts, rng)
    origins, normals = _random_points(mesh, faces, rng)
    directions = rng.normal(size=origins.shape)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    facing = np.sign(np.einsum("rk,rk->r", directions, normals))[:, None]
    tracer = igl.embree.EmbreeIntersector()
    tracer.init(
        np.asfortranarray(mesh.vertices, dtype=np.float32),
        np.asfortranarray(mesh.triangles, dtype=np.int32),
    )
    escaped, flown, hits = (np.zeros((2, patches)) for _ in range(3))
    starts = origins.astype(np.float32)
    for side, sign in enumerate((1.0, -1.0)):
        rays = (directions * facing * sign).astype(np.float32)
        found = [
            tracer.intersectRay_first(*ray, RAY_START) for ray in zip(starts, rays, strict=True)
        ]
        missed = np.array([hit[0] < 0 for hit in found])
        far = np.array([0.0 if hit[0] < 0 else hit[3] for hit in found])
        escaped[side] = np.bincount(parts.patch[faces], missed, patches)
        flown[side] = np.bincount(parts.patch[faces], far, patches)
        hits[side] = np.bincount(parts.patch[faces], ~missed, patches)
    return escaped, flown / np.maximum(hits, 1)


def _ray_faces(parts: _Patches, rng: np.random.Generator) -> Int64:
    """Triangles from which rays start: some in every patch, and more by area; at most a cap."""
    face_areas = triangle_areas(parts.mesh)
    cumulative = np.cumsum(face_areas)
    count = RAYS_BY_AREA
    by_area = np.searchsorted(cumulative, rng.random(count) * cumulative[-1], side="right")
    order = np.argsort(parts.patch, kind="stable")
    stops = np.cumsum(face_areas[order])
    last = np.flatnonzero(np.diff(parts.patch[order], append=-1))
    starts = np.concatenate([[0.0], stops[last][:-1]])
    each = max(1, min(RAYS_PER_PATCH, (RAYS_LIMIT - count) // len(last)))
    places = starts[:, None] + rng.random((len(last), each)) * (stops[last] - starts)[:, None]
    by_patch = order[np.minimum(np.searchsorted(stops, places.ravel()), len(order) - 1)]
    return np.concatenate([np.minimum(by_area, len(face_areas) - 1), by_patch]).astype(np.int64)


def _random_points(mesh: Mesh, faces: Int64, rng: np.random.Generator) -> tuple[Float64, Float64]:
    """A uniform point in each given triangle, and the triangle's normal (not of length 1)."""
    a, b, c = (mesh.vertices[mesh.triangles[faces, k]] for k in range(3))
    root, along = np.sqrt(rng.random(len(faces)))[:, None], rng.random(len(faces))[:, None]
    points = (1 - root) * a + root * (1 - along) * b + root * along * c
    return points, np.cross(b - a, c - a)
