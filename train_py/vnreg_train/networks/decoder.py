"""Implicit occupancy decoder, used in training only (paper, section III-C2)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.vn import VNLinearNormReLU


class ConditionalBatchNorm(nn.Module):
    """Batch norm whose scale and shift are linear in the condition (B, K)."""

    def __init__(self, condition: int, channels: int) -> None:
        super().__init__()
        self.bn = nn.BatchNorm1d(channels, affine=False)
        self.scale = nn.Linear(condition, channels)
        self.shift = nn.Linear(condition, channels)
        for layer, bias in ((self.scale, 1.0), (self.shift, 0.0)):
            nn.init.zeros_(layer.weight)
            nn.init.constant_(layer.bias, bias)

    def forward(self, x: Tensor, condition: Tensor) -> Tensor:
        normed = self.bn(x.transpose(1, 2)).transpose(1, 2)
        return self.scale(condition).unsqueeze(1) * normed + self.shift(condition).unsqueeze(1)


class DecoderBlock(nn.Module):
    """Residual block of two conditional batch norms; its second linear map starts at zero."""

    def __init__(self, condition: int, width: int) -> None:
        super().__init__()
        self.bn0 = ConditionalBatchNorm(condition, width)
        self.fc0 = nn.Linear(width, width)
        self.bn1 = ConditionalBatchNorm(condition, width)
        self.fc1 = nn.Linear(width, width)
        nn.init.zeros_(self.fc1.weight)

    def forward(self, x: Tensor, condition: Tensor) -> Tensor:
        h = self.fc0(torch.relu(self.bn0(x, condition)))
        return x + self.fc1(torch.relu(self.bn1(h, condition)))


class OccupancyDecoder(nn.Module):
    """Is a query inside the shape that a global feature describes? Rotation-invariant.

    Inputs per query q: <q, c_k> for every channel k, and |q|. The condition is the invariant
    layer's product C Z^T of the global feature itself.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        c, width = config.global_channels, config.decoder_width
        self.frame = nn.ModuleList(
            [
                VNLinearNormReLU(c, c // 2, config.shared_direction),
                VNLinearNormReLU(c // 2, c // 4, config.shared_direction),
                nn.Linear(c // 4, 3, bias=False),
            ]
        )
        self.enter = nn.Linear(c + 1, width)
        self.blocks = nn.ModuleList(DecoderBlock(3 * c, width) for _ in range(5))
        self.bn = ConditionalBatchNorm(3 * c, width)
        self.leave = nn.Linear(width, 1)

    def forward(self, queries: Tensor, feature: Tensor) -> Tensor:
        """queries (B, Q, 3), feature (B, 3, C) in the same frame -> logits (B, Q)."""
        z = feature.unsqueeze(1)
        for layer in self.frame:
            z = layer(z)
        condition = (feature.transpose(1, 2) @ z.squeeze(1)).flatten(1)
        distance = torch.linalg.vector_norm(queries, dim=-1, keepdim=True)
        x = self.enter(torch.cat([queries @ feature, distance], dim=-1))
        for block in self.blocks:
            x = block(x, condition)
        return self.leave(torch.relu(self.bn(x, condition))).squeeze(-1)
