"""Losses of the network `vnreg`. Pairs come unturned: the true rotation is the identity."""

from __future__ import annotations

import torch
import torch.nn.functional as functional
from torch import Tensor

from vnreg_train.networks.descriptor import Features
from vnreg_train.training.losses import consistency_loss

MATCH_RADIUS = 0.18  # network units, about 0.06 of an object's longest side
MATCH_SIGMA = 0.08  # a little less than the spacing of the encoded points
FRAME_SIGMA = 0.3  # error of unit frames, relative to what they determine, that counts as large

Figures = dict[str, Tensor]


def soft_targets(source: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
    """Distances (B, E, E) of aligned points and what a match is worth: Gaussian, 0 beyond reach."""
    distance = torch.cdist(source, target)
    worth = torch.exp(-0.5 * (distance / MATCH_SIGMA).square())
    return distance, worth * (distance < MATCH_RADIUS)


def cross_entropy(similarity: Tensor, worth: Tensor, dim: int) -> Tensor:
    """Mean over the points with a counterpart of the cross entropy with normalised worth."""
    total = worth.sum(dim)
    has_match = (total > 0.05).float()
    entropy = -(worth * torch.log_softmax(similarity, dim)).sum(dim) / (total + 1e-6)
    return (entropy * has_match).sum() / (has_match.sum() + 1e-6)


def matching_loss(similarity: Tensor, worth: Tensor) -> Tensor:
    """InfoNCE with soft targets, both ways."""
    return 0.5 * (cross_entropy(similarity, worth, 1) + cross_entropy(similarity, worth, 2))


def hits(similarity: Tensor, distance: Tensor, dim: int) -> Tensor:
    """1 where the best match along `dim` is right."""
    best = similarity.argmax(dim, keepdim=True)
    return (distance.gather(dim, best).squeeze(dim) < MATCH_RADIUS).float()


def frame_loss(source: Tensor, target: Tensor, worth: Tensor) -> Tensor:
    """How well the frames (B, E, 3, F) of true matches determine the rotation.

    Unit frames differ by e; about their worst axis they determine a rotation with the moment
    1 - λ_max of their Gram matrix, which 1 - tr(G²) bounds from below up to a factor of 2. The
    logarithm lets go of points whose surroundings determine no frame.
    """
    weight, nearest = worth.max(2)
    index = nearest[:, :, None, None].expand_as(source)
    partner = target.gather(1, index)
    error = (source - partner).square().sum((2, 3))
    spread = 0.5 * (determinacy(source) + determinacy(partner))
    loss = torch.log1p(error / (FRAME_SIGMA**2 * (spread + 0.02)))
    return (loss * weight).sum() / (weight.sum() + 1e-6)


def determinacy(frames: Tensor) -> Tensor:
    """1 - tr(G²) of the Gram matrix G of unit frames (…, 3, F): 0 for parallel vectors, to 2/3."""
    gram = frames @ frames.transpose(-1, -2)
    return 1 - gram.square().sum((-2, -1))


def descriptor_losses(
    source: Features,
    target: Features,
    x: Tensor,
    y: Tensor,
    shift: Tensor,
    weights: dict[str, float],
) -> tuple[Tensor, Figures]:
    """Weighted sum and terms. x, y (B, E, 3) about their centroids; y ~ x + shift (B, 3)."""
    distance, worth = soft_targets(x + shift.unsqueeze(1), y)
    local = source.local @ target.local.transpose(1, 2)
    context = source.context @ target.context.transpose(1, 2)
    both = local + context
    has_x, has_y = ((worth.sum(dim) > 0.05).float() for dim in (2, 1))
    hit_x, hit_y = hits(both.detach(), distance, 2), hits(both.detach(), distance, 1)
    bce = functional.binary_cross_entropy_with_logits
    rows = torch.cat([source.global_feature + shift.unsqueeze(2), target.global_feature])
    g_source, g_target = rows.chunk(2)
    terms = {
        "match": matching_loss(both, worth),
        "match_local": matching_loss(local, worth),
        "match_context": matching_loss(context, worth),
        "significance": bce(source.significance, hit_x) + bce(target.significance, hit_y),
        "overlap": bce(source.overlap, has_x) + bce(target.overlap, has_y),
        "frames_local": frame_loss(source.frames_local, target.frames_local, worth),
        "frames_context": frame_loss(source.frames_context, target.frames_context, worth),
        "global": consistency_loss(g_source, g_target)
        + (g_source - g_target).mean(2).square().sum(1).mean(),
    }
    loss = torch.stack([weights[name] * term for name, term in terms.items()]).sum()
    local_hit = hits(local.detach(), distance, 2)
    figures = {
        "inliers": (hit_x * has_x).sum() / has_x.sum(),
        "inliers_local": (local_hit * has_x).sum() / has_x.sum(),
    }
    return loss, terms | figures
