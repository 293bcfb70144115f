"""From padded pairs to network coordinates: what one step of the network `vnreg` sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from vnreg_train.data.mixture import PaddedPairs


@dataclass
class DescriptorBatch:
    """Clouds stacked source first, then target, in network coordinates."""

    points: Tensor  # (2B, N, 3), each cloud about its own centroid; padding is zero
    mask: Tensor  # (2B, N): 1 for points, 0 for padding
    shift: Tensor  # (B, 3): target = source + shift


def network_batch(pairs: PaddedPairs) -> DescriptorBatch:
    """Centres the clouds and divides both by the larger of their r.m.s. radii."""
    clouds = np.concatenate([pairs.source, pairs.target]).astype(np.float64)
    counts = np.concatenate([pairs.source_count, pairs.target_count])
    mask = np.arange(clouds.shape[1]) < counts[:, None]
    centroid = clouds.sum(1) / counts[:, None]
    clouds = (clouds - centroid[:, None]) * mask[..., None]
    radius = np.sqrt(np.square(clouds).sum((1, 2)) / counts)
    half = len(pairs.source)
    scale = np.maximum(radius[:half], radius[half:])
    clouds /= np.tile(scale, 2)[:, None, None]
    shift = (centroid[:half] - centroid[half:]) / scale[:, None]
    points, weight, shift = (torch.from_numpy(a.astype(np.float32)) for a in (clouds, mask, shift))
    return DescriptorBatch(points, weight, shift)
