"""The network `vnreg`: equivariant features that propose poses (docs/design.md, same names).

Vector features are (batch, points, 3, channels), as in `vn`.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
import torch.nn.functional as functional
from torch import Tensor, nn

from vnreg_train.networks.descriptor_config import DescriptorConfig
from vnreg_train.networks.moments import (
    CONTEXT_VECTORS,
    LOCAL_VECTORS,
    SCALARS,
    context_vectors,
    kernel_weights,
    local_vectors,
    radius_moments,
    shape_scalars,
)
from vnreg_train.networks.vn import clip_to_half_space

RMS_EPSILON = 1e-2  # vectors that are small beside 1, the noise of flat regions, stay small


class Inputs(NamedTuple):
    """Moments of E encoded points as features."""

    local: Tensor  # (B, E, 3, 21)
    context: Tensor  # (B, E, 3, 8)
    scalars: Tensor  # (B, E, 18)


class StageEnd(NamedTuple):
    """Vectors (B, E, 3, C) and scalars (B, E, H) of the points."""

    v: Tensor
    z: Tensor


class Features(NamedTuple):
    """What the network says of a cloud; descriptors have length sqrt(temperature)."""

    local: Tensor  # (B, E, local_descriptor)
    context: Tensor  # (B, E, context_descriptor)
    significance: Tensor  # (B, E): logit of "my best match is right"
    overlap: Tensor  # (B, E): logit of "the other cloud has this place"
    frames_local: Tensor  # (B, E, 3, F), of unit Frobenius norm
    frames_context: Tensor  # (B, E, 3, F)
    global_feature: Tensor  # (B, 3, G), about the cloud's centroid


def input_features(
    points: Tensor, mask: Tensor, encoded: int, radii: tuple[float, float, float]
) -> Inputs:
    """Features of the first `encoded` points, from moments over points (B, N, 3) of the mask."""
    centres = points[:, :encoded]
    moments = [radius_moments(points, mask, centres, radius) for radius in radii]
    offsets, covariances, skews = (list(m) for m in zip(*moments, strict=True))
    return Inputs(
        local_vectors(offsets, covariances, skews),
        context_vectors(centres, offsets, covariances),
        shape_scalars(offsets, covariances),
    )


def rms_normalised(v: Tensor) -> Tensor:
    """Divides each point's vectors (…, 3, C) by their common r.m.s. length."""
    return v * torch.rsqrt(v.square().sum(-2, keepdim=True).mean(-1, keepdim=True) + RMS_EPSILON)


class Block(nn.Module):
    """v + W relu(n) + Q mean relu(n), n the normalised v; Q only where the block is pooled."""

    def __init__(self, channels: int, pooled: bool) -> None:
        super().__init__()
        self.direction = nn.Linear(channels, channels, bias=False)
        self.linear = nn.Linear(channels, channels, bias=False)
        self.pool = nn.Linear(channels, channels, bias=False) if pooled else None

    def forward(self, v: Tensor) -> Tensor:
        n = rms_normalised(v)
        n = clip_to_half_space(n, self.direction(n))
        v = v + self.linear(n)
        return v if self.pool is None else v + self.pool(n.mean(1, keepdim=True))


class Neighbourhood(nn.Module):
    """Collects features of the encoded points within a radius: vectors to vectors and scalars.

    Per point: gated offsets Σ w a_k (x_j - x_i) / r, mean vectors and mean scalars, weights as in
    `moments` with sum 1. Depends on differences of positions only.
    """

    def __init__(self, config: DescriptorConfig, radius: float) -> None:
        super().__init__()
        c, h, k = config.channels, config.scalars, config.gates
        self.radius = radius
        self.gate = nn.Linear(h, k)
        self.linear = nn.Linear(k + c, c, bias=False)

    def forward(self, points: Tensor, v: Tensor, z: Tensor) -> tuple[Tensor, Tensor]:
        """points (B, E, 3), v (B, E, 3, C), z (B, E, H) -> v with the collected, mean z."""
        weights = kernel_weights(points, points, self.radius)
        weights = weights / weights.sum(2, keepdim=True)
        n = rms_normalised(v)
        gate = self.gate(z)
        placed = points.unsqueeze(3) * gate.unsqueeze(2)  # (B, E, 3, K)
        columns = [placed.flatten(2), gate, n.flatten(2), z]
        sums = weights @ torch.cat(columns, dim=2)
        places, gates, vectors, scalars = sums.split([c.shape[2] for c in columns], dim=2)
        moved = points.unsqueeze(3) * gates.unsqueeze(2)
        offsets = (places.unflatten(2, (3, -1)) - moved) / self.radius
        collected = torch.cat([offsets, vectors.unflatten(2, (3, -1))], dim=3)
        return v + self.linear(collected), scalars


class Invariants(nn.Module):
    """Inner products of the channels with a few learned vectors of the point (and of the cloud)."""

    def __init__(self, channels: int, products: int, pooled: bool) -> None:
        super().__init__()
        self.own = nn.Linear(channels, products, bias=False)
        self.pool = nn.Linear(channels, products, bias=False) if pooled else None

    def forward(self, n: Tensor) -> Tensor:
        """Normalised vectors (B, E, 3, C) -> (B, E, C P) or (B, E, C 2P)."""
        partners = self.own(n)
        if self.pool is not None:
            pooled = self.pool(n.mean(1, keepdim=True)).expand(-1, n.shape[1], -1, -1)
            partners = torch.cat([partners, pooled], dim=3)
        return (n.transpose(2, 3) @ partners.to(n.dtype)).flatten(2)


class DescriptorNetwork(nn.Module):
    """From input features to descriptors, frames and the global feature of each cloud."""

    local_scale: Tensor
    context_scale: Tensor
    scalar_mean: Tensor
    scalar_scale: Tensor

    def __init__(self, config: DescriptorConfig) -> None:
        super().__init__()
        self.config = config
        c, h, p = config.channels, config.scalars, config.products
        for name, count in (("local", LOCAL_VECTORS), ("context", CONTEXT_VECTORS)):
            self.register_buffer(f"{name}_scale", torch.ones(count))
        self.register_buffer("scalar_mean", torch.zeros(SCALARS))
        self.register_buffer("scalar_scale", torch.ones(SCALARS))
        # Point by point.
        self.scalar0 = nn.Linear(SCALARS, h)
        self.pre_local = nn.Linear(LOCAL_VECTORS, c, bias=False)
        self.pre_gate = nn.Linear(h, c)
        self.block0 = Block(c, pooled=False)
        self.invariants0 = Invariants(c, p, pooled=False)
        self.scalar1 = nn.Linear(c * p + h, h)
        # Neighbourhood: local descriptor and frames.
        self.neighbourhood0 = Neighbourhood(config, config.neighbourhood_radii[0])
        self.local_blocks = nn.ModuleList(Block(c, False) for _ in range(config.local_blocks))
        self.invariants1 = Invariants(c, p, pooled=False)
        self.scalar2 = nn.Linear(c * p + 2 * h, h)
        self.scalar3 = nn.Linear(h, h)
        self.local_descriptor = nn.Linear(h, config.local_descriptor)
        self.local_frames = nn.Linear(c, config.frames, bias=False)
        # Context: position in the cloud, pooled blocks.
        self.pre_context = nn.Linear(CONTEXT_VECTORS, c, bias=False)
        self.neighbourhood1 = Neighbourhood(config, config.neighbourhood_radii[1])
        self.context_blocks = nn.ModuleList(Block(c, True) for _ in range(config.context_blocks))
        self.invariants2 = Invariants(c, p, pooled=True)
        self.scalar4 = nn.Linear(2 * c * p + 3 * h, h)
        self.scalar5 = nn.Linear(h, h)
        self.context_descriptor = nn.Linear(h, config.context_descriptor)
        self.context_frames = nn.Linear(c, config.frames, bias=False)
        self.logits = nn.Linear(h, 3)  # significance, overlap, share in the global feature
        self.global_linear = nn.Linear(c, config.global_channels, bias=False)
        self.temperature = nn.Parameter(torch.tensor([2.3, 2.3]))  # logarithms: local, context
        nn.init.zeros_(self.pre_gate.weight)
        nn.init.ones_(self.pre_gate.bias)

    @torch.no_grad()
    def fit_inputs(self, inputs: Inputs) -> None:
        """Sets the input scales so that every vector has r.m.s. length 1, every scalar spread 1."""
        for name in ("local", "context"):
            size = getattr(inputs, name).square().sum(2).mean((0, 1)).sqrt()
            getattr(self, f"{name}_scale").copy_(1 / size.clamp(min=1e-6))
        flat = inputs.scalars.flatten(0, 1)
        self.scalar_mean.copy_(flat.mean(0))
        self.scalar_scale.copy_(1 / flat.std(0).clamp(min=1e-6))

    def point_stage(self, inputs: Inputs) -> tuple[Tensor, Tensor]:
        """Moments to v (B, E, 3, C) and z1 (B, E, H)."""
        scalars = (inputs.scalars - self.scalar_mean) * self.scalar_scale
        z0 = functional.relu(self.scalar0(scalars))
        v = self.pre_local(inputs.local * self.local_scale) * self.pre_gate(z0).unsqueeze(2)
        v = self.block0(v)
        products = self.invariants0(rms_normalised(v))
        return v, functional.relu(self.scalar1(torch.cat([products, z0], 2)))

    def local_stage(self, points: Tensor, v: Tensor, z: Tensor) -> tuple[Tensor, Tensor]:
        """The first neighbourhood: v and z2, which no far point changes."""
        v, near = self.neighbourhood0(points, v, z)
        for block in self.local_blocks:
            v = block(v)
        products = self.invariants1(rms_normalised(v))
        z = functional.relu(self.scalar2(torch.cat([products, z, near], 2)))
        return v, functional.relu(self.scalar3(z))

    def context_stage(
        self, points: Tensor, inputs: Inputs, v: Tensor, z: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Position, the second neighbourhood and pooled blocks: v and z3."""
        v = v + self.pre_context(inputs.context * self.context_scale)
        v, near = self.neighbourhood1(points, v, z)
        for block in self.context_blocks:
            v = block(v)
        products = self.invariants2(rms_normalised(v))
        pooled = z.mean(1, keepdim=True).expand_as(z)
        z = functional.relu(self.scalar4(torch.cat([products, z, near, pooled], 2)))
        return v, functional.relu(self.scalar5(z))

    def heads(self, points: Tensor, local: StageEnd, context: StageEnd) -> Features:
        """What the ends of the local and of the context stage give."""
        n_local, n = rms_normalised(local.v), rms_normalised(context.v)
        exact = points.dtype  # the descriptors leave autocast
        logits = self.logits(context.z).to(exact)
        length = torch.exp(0.5 * self.temperature)
        return Features(
            functional.normalize(self.local_descriptor(local.z).to(exact), dim=2) * length[0],
            functional.normalize(self.context_descriptor(context.z).to(exact), dim=2) * length[1],
            logits[..., 0],
            logits[..., 1],
            unit_frames(self.local_frames(n_local).to(exact)),
            unit_frames(self.context_frames(n).to(exact)),
            self._global_feature(points, n, logits[..., 2]),
        )

    def forward(self, points: Tensor, inputs: Inputs) -> Features:
        """points (B, E, 3): the encoded points, about their cloud's centroid."""
        v, z = self.point_stage(inputs)
        local = StageEnd(*self.local_stage(points, v, z))
        context = StageEnd(*self.context_stage(points, inputs, *local))
        return self.heads(points, local, context)

    def _global_feature(self, points: Tensor, n: Tensor, logit: Tensor) -> Tensor:
        share = torch.softmax(logit, 1)[:, :, None, None]
        vectors = self.global_linear((n * share).sum(1)).to(points.dtype)
        return vectors + (points.unsqueeze(3) * share).sum(1)


def split_pair(features: Features) -> tuple[Features, Features]:
    """Features of clouds stacked source first, then target -> of the sources, of the targets."""
    source, target = zip(*(f.chunk(2) for f in features), strict=True)
    return Features(*source), Features(*target)


def unit_frames(frames: Tensor) -> Tensor:
    """Frame vectors (B, E, 3, F) divided by their Frobenius norm."""
    return frames * torch.rsqrt(frames.square().sum((2, 3), keepdim=True) + 1e-12)
