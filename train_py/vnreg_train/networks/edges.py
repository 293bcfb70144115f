"""Edge vectors of the k nearest neighbours: the encoder's input (paper, section III-B1).

Per neighbour j of i the paper takes (x_j - x_i, x_i, x_j × x_i), applies a VN-linear and averages
over j. Both are linear, so the average can come first: three mean vectors per point, exactly.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from torch import Tensor


def edge_vectors(points: Tensor, neighbour_mean: Tensor) -> Tensor:
    """Points and neighbour means, both (B, N, 3) -> (B, N, 3 coordinates, 3 vectors)."""
    cross = torch.linalg.cross(neighbour_mean, points)
    return torch.stack([neighbour_mean - points, points, cross], dim=-1)


def neighbour_mean(points: Tensor, k: int) -> Tensor:
    """Mean of the k nearest points, the point included: (B, N, 3) -> (B, N, 3). The reference.

    Distances are (dx² + dy²) + dz² in the dtype of the points; ties go to the lower index.
    """
    means = []
    for cloud in points:  # one cloud at a time bounds the memory by N²
        difference = (cloud[:, None, :] - cloud[None, :, :]).square()
        distance = (difference[..., 0] + difference[..., 1]) + difference[..., 2]
        nearest = torch.sort(distance, dim=1, stable=True).indices[:, :k]
        means.append(cloud[nearest].mean(1))
    return torch.stack(means)


def neighbour_mean_kdtree(points: NDArray[np.float32], k: int) -> NDArray[np.float32]:
    """As `neighbour_mean`, by k-d tree and up to ties: (B, N, 3) -> (B, N, 3). For training."""
    means = np.empty_like(points)
    for cloud, mean in zip(points, means, strict=True):
        _, nearest = cKDTree(cloud).query(cloud, k)
        mean[:] = cloud[np.asarray(nearest).reshape(len(cloud), k)].mean(1)
    return means
