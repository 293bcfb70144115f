"""Losses of the first stage (paper, sections III-C2 and III-C3)."""

from __future__ import annotations

from typing import Any

import torch
import torch.nn.functional as functional
from torch import Tensor

PAPER_QUERIES = 2048


def registration_loss(rotation: Tensor, translation: Tensor) -> Tensor:
    """|R_gt^T R - I|_F² + |t - t_gt|² (eq. 8) of residuals R_gt^T R, t - t_gt; batch's mean."""
    identity = torch.eye(3, dtype=rotation.dtype, device=rotation.device)
    angular = (rotation - identity).square().sum((1, 2))
    return (angular + translation.square().sum(1)).mean()


def occupancy_loss(logits: Tensor, occupancies: Tensor) -> Tensor:
    """Cross entropy (eq. 7) as the sum over 2,048 queries, whatever their number here."""
    return functional.binary_cross_entropy_with_logits(logits, occupancies) * PAPER_QUERIES


def consistency_loss(source: Tensor, target: Tensor) -> Tensor:
    """Ours: how far paired global vectors are apart at the true rotation, whitened; 0 to 4.

    source, target: (B, 3, C), unturned. Untrained global features are nearly collinear, and the
    gradient of Procrustes explodes there. This term measures the difference of the centred vectors
    in every direction relative to their spread in that direction (a Mahalanobis distance, so it
    turns with the cloud), which is what decides the accuracy of the rotation about each axis.
    """
    source, target = (v - v.mean(2, keepdim=True) for v in (source, target))
    spread = (_covariance(source) + _covariance(target)) / 2
    trace = spread.diagonal(dim1=1, dim2=2).sum(1)
    identity = torch.eye(3, dtype=source.dtype, device=source.device)
    spread = spread + (1e-4 * trace[:, None, None] + 1e-12) * identity
    # Features that are not finite give a loss that is not: cholesky() would stop the training.
    factor = torch.linalg.cholesky_ex(spread).L
    whitened = torch.linalg.solve_triangular(factor, source - target, upper=False)
    return whitened.square().mean((1, 2)).mean()


def _covariance(vectors: Tensor) -> Tensor:
    centred = vectors - vectors.mean(2, keepdim=True)
    return centred @ centred.transpose(1, 2) / vectors.shape[2]


class _LimitGradient(torch.autograd.Function):
    """The identity, whose gradient per sample is at most `limit` for vectors of unit spread."""

    @staticmethod
    def forward(ctx: Any, vectors: Tensor, limit: float) -> Tensor:
        ctx.spread = _covariance(vectors).diagonal(dim1=1, dim2=2).sum(1).sqrt()
        ctx.limit = limit
        return vectors.view_as(vectors)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None]:
        (gradient,) = gradients
        size = gradient.flatten(1).norm(dim=1) * ctx.spread
        factor = (ctx.limit / size.clamp(min=1e-30)).clamp(max=1.0)
        factor = torch.where(torch.isfinite(size), factor, 0.0)
        return torch.nan_to_num(gradient) * factor[:, None, None], None


def limit_gradient(vectors: Tensor, limit: float) -> Tensor:
    """Ours: keeps one ill-conditioned Procrustes problem from drowning a batch. vectors (B, 3, C).

    With a limit of 0 the gradient is left alone (the paper's training).
    """
    return _LimitGradient.apply(vectors, limit) if limit > 0 else vectors
