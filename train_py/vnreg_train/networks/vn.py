"""Vector neurons (paper, section III-B): layers that commute with rotations.

Features are (batch, points, 3, channels): channels last, so that every VN-linear is one plain
matrix product and x, y, z are three rows of the same kind.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

EPSILON = 1e-7


class VNLinear(nn.Module):
    """V' = W V on channels; no bias, so rotations pass through."""

    def __init__(self, channels_in: int, channels_out: int) -> None:
        super().__init__()
        self.linear = nn.Linear(channels_in, channels_out, bias=False)

    def forward(self, v: Tensor) -> Tensor:
        return self.linear(v)


def clip_to_half_space(v: Tensor, d: Tensor) -> Tensor:
    """Removes from v (…, 3, C) its part against direction d (…, 3, C or 1): the VN-ReLU."""
    dot = (v * d).sum(-2, keepdim=True)
    return v - dot.clamp(max=0.0) / (d.square().sum(-2, keepdim=True) + EPSILON) * d


class VNReLU(nn.Module):
    """Leaky slope 0, with a direction per channel or one shared by all channels."""

    def __init__(self, channels: int, shared_direction: bool) -> None:
        super().__init__()
        self.direction = nn.Linear(channels, 1 if shared_direction else channels, bias=False)

    def forward(self, v: Tensor) -> Tensor:
        return clip_to_half_space(v, self.direction(v))


class ScalarLinear(nn.Module):
    """The ablation's VNLinear: mixes coordinates and channels, so it is not equivariant."""

    def __init__(self, channels_in: int, channels_out: int) -> None:
        super().__init__()
        self.linear = nn.Linear(3 * channels_in, 3 * channels_out, bias=False)

    def forward(self, v: Tensor) -> Tensor:
        return self.linear(v.flatten(-2)).unflatten(-1, (3, -1))


class ScalarReLU(nn.Module):
    """The ablation's counterpart of VNReLU."""

    def forward(self, v: Tensor) -> Tensor:
        return torch.relu(v)


def linear(channels_in: int, channels_out: int, vector_neurons: bool) -> nn.Module:
    """A linear map of vector features, equivariant or (ablation) not."""
    layer = VNLinear if vector_neurons else ScalarLinear
    return layer(channels_in, channels_out)


def relu(channels: int, vector_neurons: bool, shared_direction: bool) -> nn.Module:
    """A non-linearity of vector features, equivariant or (ablation) not."""
    return VNReLU(channels, shared_direction) if vector_neurons else ScalarReLU()


class VNResNetBlock(nn.Module):
    """out = S v + F1 relu1(F0 relu0(v)); S is the identity when the widths agree; F1 starts at
    zero.
    """

    def __init__(
        self, channels_in: int, channels_out: int, vector_neurons: bool, shared_direction: bool
    ) -> None:
        super().__init__()
        hidden = min(channels_in, channels_out)
        self.relu0 = relu(channels_in, vector_neurons, shared_direction)
        self.fc0 = linear(channels_in, hidden, vector_neurons)
        self.relu1 = relu(hidden, vector_neurons, shared_direction)
        self.fc1 = linear(hidden, channels_out, vector_neurons)
        self.shortcut: nn.Module = (
            nn.Identity()
            if channels_in == channels_out
            else linear(channels_in, channels_out, vector_neurons)
        )
        for parameter in self.fc1.parameters():
            nn.init.zeros_(parameter)

    def forward(self, v: Tensor) -> Tensor:
        return self.shortcut(v) + self.fc1(self.relu1(self.fc0(self.relu0(v))))


def with_pooled(v: Tensor) -> Tensor:
    """[v; mean of v over the cloud]: (B, N, 3, C) -> (B, N, 3, 2C)."""
    return torch.cat([v, v.mean(1, keepdim=True).expand_as(v)], dim=-1)


class VNBatchNorm(nn.Module):
    """Scales every vector by BN(|v|)/|v|, with batch statistics of the norms per channel."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.bn = nn.BatchNorm1d(channels)

    def forward(self, v: Tensor) -> Tensor:
        norm = torch.linalg.vector_norm(v, dim=-2) + EPSILON  # (B, N, C)
        scaled = self.bn(norm.transpose(1, 2)).transpose(1, 2)
        return v * (scaled / norm).unsqueeze(-2)


class VNLinearNormReLU(nn.Module):
    """VN-linear, VN batch norm, VN-ReLU whose direction comes from the layer's own input."""

    def __init__(self, channels_in: int, channels_out: int, shared_direction: bool) -> None:
        super().__init__()
        self.fc = nn.Linear(channels_in, channels_out, bias=False)
        self.norm = VNBatchNorm(channels_out)
        self.direction = nn.Linear(channels_in, 1 if shared_direction else channels_out, bias=False)

    def forward(self, v: Tensor) -> Tensor:
        return clip_to_half_space(self.norm(self.fc(v)), self.direction(v))
