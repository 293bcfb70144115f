"""What a viewpoint sees of a surface given by points, as a depth camera would.

Katz, Tal, Basri: Direct visibility of point sets, SIGGRAPH 2007: points are flipped about a large
sphere around the viewpoint; those on the convex hull of the flipped points and the viewpoint are
visible.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from vnreg_train.data.mesh import Float64

# Of the sphere, in distances of the furthest point: larger lets the surface through in more places,
# smaller hides more of what is bent.
FLIP_RADIUS = 300.0


def visible(points: Float64, viewpoint: Float64) -> NDArray[np.bool_]:
    """Which of the points (N, 3) are seen from the viewpoint (3,), which lies outside them.

    Raises ValueError where a point lies at the viewpoint, or all lie in a plane with it.
    """
    offsets = points - viewpoint
    distances = np.linalg.norm(offsets, axis=1, keepdims=True)
    if not distances.min() > 0:
        raise ValueError("the viewpoint lies on a point")
    radius = FLIP_RADIUS * distances.max()
    flipped = offsets + 2 * (radius - distances) * offsets / distances
    try:
        hull = ConvexHull(np.vstack([flipped, np.zeros(3)]))
    except Exception as error:
        raise ValueError(f"no view: {error}") from error
    seen = np.zeros(len(points) + 1, bool)
    seen[hull.vertices] = True
    return seen[:-1]
