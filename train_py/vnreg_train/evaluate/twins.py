"""Wrong poses that place the shape nearly as the right one does: twins.

A shape need not be symmetric by the stated test for two poses to be told apart by details alone,
which noise, crops and sparse samples hide.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from vnreg_train.data.mesh import Float32, Float64

NEAR = 0.03  # of the longest side: three deviations of the noise that the rows with a bar have
SHARE = 0.9


def twin_share(surface: Float32, estimate: Float64, truth: Float64) -> float:
    """Share of a shape's surface near itself as the two poses (4, 4) place it; 1 for equal poses.

    surface: dense samples (N, 3). The lesser of both ways; near means closer than NEAR.
    """
    move = np.linalg.inv(truth) @ estimate
    points = surface.astype(np.float64)
    tree = cKDTree(points)
    there = points @ move[:3, :3].T + move[:3, 3]
    back = (points - move[:3, 3]) @ move[:3, :3]
    near = [tree.query(p, distance_upper_bound=NEAR)[0] < np.inf for p in (there, back)]
    return float(min(which.mean() for which in near))


def is_twin(surface: Float32, estimate: Float64, truth: Float64) -> bool:
    """Whether SHARE of the surface is near itself."""
    return twin_share(surface, estimate, truth) >= SHARE
