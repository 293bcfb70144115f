"""Coarse register: closed-form pose from paired points or features (paper, section III-C1)."""

from __future__ import annotations

import torch
from torch import Tensor


def procrustes(
    source: Tensor,
    target: Tensor,
    weight: Tensor | None = None,
    *,
    weighted_centroids: bool = True,
) -> tuple[Tensor, Tensor]:
    """Rigid (R, t) that minimises Σ w |R x + t - y|² over paired rows.

    source, target: (B, n, 3); weight: (B, n), not negative, or None for equal weights. Weights that
    are all zero give the identity.
    Returns R (B, 3, 3) with determinant +1 and t (B, 3). Solved in float64; differentiable. The
    centroids are weighted in the covariance too, unless `weighted_centroids` is false, which is
    what the authors' code does.
    """
    x, y = source.double(), target.double()
    w = torch.ones_like(x[..., 0]) if weight is None else weight.double()
    w = (w / w.sum(1, keepdim=True).clamp(min=1e-300)).unsqueeze(-1)
    x_mean, y_mean = (w * x).sum(1, keepdim=True), (w * y).sum(1, keepdim=True)
    x_centre, y_centre = x_mean, y_mean
    if not weighted_centroids:
        x_centre, y_centre = x.mean(1, keepdim=True), y.mean(1, keepdim=True)
    covariance = (w * (y - y_centre)).transpose(1, 2) @ (x - x_centre)
    u, _, vh = torch.linalg.svd(covariance)
    sign = torch.ones_like(u[:, 0])
    sign[:, 2] = torch.det(u.detach() @ vh.detach()).sign()
    rotation = (u * sign.unsqueeze(1)) @ vh
    translation = y_mean.squeeze(1) - (rotation @ x_mean.transpose(1, 2)).squeeze(2)
    return rotation.to(source.dtype), translation.to(source.dtype)
