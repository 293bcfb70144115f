"""Query points in and around a mesh, and whether each lies inside it."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray

from vnreg_train.data.mesh import Float32, Mesh, sample_surface
from vnreg_train.data.orientation import oriented_outward

BOX_HALF_SIDE = 0.55
NEAR_SIGMA = 0.03


def sample_queries(mesh: Mesh, count: int, rng: np.random.Generator) -> Float32:
    """Query points (count, 3) for a normalised mesh, in random order.

    Half are uniform in [-0.55, 0.55]^3, half are surface samples moved by N(0, 0.03) per axis.
    """
    near = sample_surface(mesh, count // 2, rng)
    near += rng.normal(0.0, NEAR_SIGMA, near.shape)
    uniform = rng.uniform(-BOX_HALF_SIDE, BOX_HALF_SIDE, (count - len(near), 3))
    return rng.permutation(np.concatenate([near, uniform])).astype(np.float32)


def label_queries(mesh: Mesh, queries: Float32) -> NDArray[np.uint8]:
    """Whether each query (Q, 3) lies inside the mesh, (Q,) of 0 and 1.

    Inside means a generalised winding number above 1/2 after the mesh was oriented outward (see
    orientation.py): right for closed solids, their unions and their cavities whatever way the
    triangles face, and a smooth closing of openings for surfaces that are not closed. A single
    sheet encloses nothing. The mesh must be welded: a sheet exported from both sides would
    cancel out.
    """
    oriented = oriented_outward(mesh)
    winding = igl.fast_winding_number(
        np.ascontiguousarray(oriented.vertices),
        np.ascontiguousarray(oriented.triangles),
        queries.astype(np.float64),
    )
    return (np.asarray(winding) > 0.5).astype(np.uint8)
