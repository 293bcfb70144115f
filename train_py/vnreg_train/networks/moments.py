"""What a point sees of its surroundings: moments within a few radii.

With weights w = (1 - d²/r²)²₊ of the points at distance d, divided by their sum, they depend
neither on the number of points nor on their order, vary smoothly, and need no nearest neighbours.
"""

from __future__ import annotations

import torch
from torch import Tensor

LOCAL_VECTORS = 21
CONTEXT_VECTORS = 8
SCALARS = 18
SMALL = 1e-4  # keeps ratios of the moments of an isolated point finite


def kernel_weights(points: Tensor, centres: Tensor, radius: float) -> Tensor:
    """(1 - d²/r²)²₊ of points (B, N, 3) seen from centres (B, E, 3): (B, E, N)."""
    squared = (
        centres.square().sum(2)[:, :, None]
        + points.square().sum(2)[:, None, :]
        - 2 * (centres @ points.transpose(1, 2))
    )
    return (1 - squared / (radius * radius)).clamp(min=0.0).square()


def radius_moments(
    points: Tensor, mask: Tensor, centres: Tensor, radius: float
) -> tuple[Tensor, Tensor, Tensor]:
    """Moments of points (B, N, 3), where mask (B, N) is 1, about centres (B, E, 3).

    With δ the offsets from the centre and <> the weighted mean: offset o = <δ>/r (B, E, 3);
    covariance 4 <δδᵀ>/r² - 4 o oᵀ (B, E, 3, 3); skew <|δ|² δ>/r³ (B, E, 3).
    """
    outer = points.unsqueeze(3) * points.unsqueeze(2)
    columns = torch.cat(
        [
            torch.ones_like(points[..., :1]),
            points,
            points.square().sum(2, keepdim=True) * points,
            outer.flatten(2),
        ],
        dim=2,
    )
    sums = kernel_weights(points, centres, radius) @ (columns * mask.unsqueeze(2))
    total, first, third, second = sums.split([1, 3, 3, 9], dim=2)
    mean, third = first / total, third / total
    second = (second / total).unflatten(2, (3, 3))
    # From moments about the origin to moments about the centre.
    delta = mean - centres
    squared = centres.square().sum(2, keepdim=True)
    trace = second.diagonal(dim1=2, dim2=3).sum(2, keepdim=True)
    along = (centres * mean).sum(2, keepdim=True)
    skew = (
        third
        - trace * centres
        - 2 * (second @ centres.unsqueeze(3)).squeeze(3)
        + 2 * along * centres
        + squared * delta
    )
    covariance = second - mean.unsqueeze(3) * mean.unsqueeze(2)
    return delta / radius, 4 / radius**2 * covariance, skew / radius**3


def _times(matrix: Tensor, vector: Tensor) -> Tensor:
    return (matrix @ vector.unsqueeze(-1)).squeeze(-1)


def _cross(a: Tensor, b: Tensor) -> Tensor:
    return torch.cross(a, b, dim=-1)


def _dot(a: Tensor, b: Tensor) -> Tensor:
    return (a * b).sum(-1)


def determinant(m: Tensor) -> Tensor:
    """Of symmetric matrices (…, 3, 3), by its terms: torch's factorises."""
    a, b, c = m[..., 0, 0], m[..., 0, 1], m[..., 0, 2]
    d, e, f = m[..., 1, 1], m[..., 1, 2], m[..., 2, 2]
    return a * (d * f - e * e) - b * (b * f - e * c) + c * (b * e - d * c)


def shape_scalars(offsets: list[Tensor], covariances: list[Tensor]) -> Tensor:
    """Invariants of the moments of three radii: (B, E, 18), in the order of docs/design.md."""
    traces = [c.diagonal(dim1=-2, dim2=-1).sum(-1) for c in covariances]
    scalars = []
    for o, c, trace in zip(offsets, covariances, traces, strict=True):
        scalars += [
            trace,
            c.square().sum((-2, -1)) / (trace.square() + SMALL),
            27 * determinant(c) / (trace**3 + SMALL),
            torch.sqrt(_dot(o, o) + SMALL),
        ]
    pairs = ((0, 1), (1, 2), (0, 2))
    scalars += [_dot(offsets[i], offsets[j]) for i, j in pairs]
    scalars += [
        (covariances[i] * covariances[j]).sum((-2, -1)) / (traces[i] * traces[j] + SMALL)
        for i, j in pairs
    ]
    return torch.stack(scalars, dim=-1)


def local_vectors(offsets: list[Tensor], covariances: list[Tensor], skews: list[Tensor]) -> Tensor:
    """Translation-invariant equivariant vectors of three radii: (B, E, 3, 21)."""
    o, c = offsets, covariances
    turned = [[_times(c[i], o[j]) for j in range(3)] for i in range(3)]
    vectors = [*o, *skews, *turned[0], *turned[1], *turned[2]]
    vectors += [_cross(o[0], o[1]), _cross(o[1], o[2]), _cross(o[0], o[2])]
    vectors += [_cross(turned[0][1], o[1]), _cross(turned[1][2], o[2]), _cross(turned[0][2], o[2])]
    return torch.stack(vectors, dim=-1)


def context_vectors(centres: Tensor, offsets: list[Tensor], covariances: list[Tensor]) -> Tensor:
    """Vectors of the positions (B, E, 3) about the cloud's centroid: (B, E, 3, 8)."""
    turned = [_times(c, centres) for c in covariances]
    crossed = [_cross(o, centres) for o in offsets]
    return torch.stack([centres, *turned, *crossed, _cross(turned[1], centres)], dim=-1)
