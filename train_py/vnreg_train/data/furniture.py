"""Shapes from furniture models: surface points and occupancy queries of one OBJ file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vnreg_train.data.catalog import stable_seed
from vnreg_train.data.mesh import Float32, checked_mesh, normalised, sample_surface, welded
from vnreg_train.data.obj import parse_obj
from vnreg_train.data.occupancy import label_queries, sample_queries

BUILDER_VERSION = 1
SURFACE_POINTS = 16_384
QUERY_POINTS = 8_192


@dataclass(frozen=True)
class SampledShape:
    """Surface points (P, 3), query points (Q, 3) and inside labels (Q,) of one model.

    What was not asked for is None.
    """

    surface: Float32 | None
    queries: Float32 | None
    occupancies: NDArray[np.uint8] | None


def sample_shape(
    model: str, obj: bytes, surface: bool = True, occupancy: bool = True
) -> SampledShape:
    """Samples of one model: a pure function of its path (the seed) and the OBJ's bytes.

    The shape is centred at its bounding-box centre and scaled to longest side 1; surface points
    are uniform by area, coincident triangles counted once. The catalog's display rotations are
    not applied: a shape's own pose means nothing here. Raises MeshError.
    """
    mesh = welded(parse_obj(obj))
    mesh = normalised(checked_mesh(mesh.vertices, mesh.triangles))
    points = queries = labels = None
    if surface:
        rng = np.random.default_rng(stable_seed("surface", BUILDER_VERSION, model))
        points = sample_surface(mesh, SURFACE_POINTS, rng).astype(np.float32)
    if occupancy:
        rng = np.random.default_rng(stable_seed("queries", BUILDER_VERSION, model))
        queries = sample_queries(mesh, QUERY_POINTS, rng)
        labels = label_queries(mesh, queries)
    return SampledShape(points, queries, labels)
