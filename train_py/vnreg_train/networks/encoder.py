"""The SE(3)-equivariant feature extractor (paper, section III-B, figure 2b)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.vn import (
    VNLinearNormReLU,
    VNResNetBlock,
    linear,
    relu,
    with_pooled,
)


class GlobalModule(nn.Module):
    """Edge vectors (B, N, 3, 3) -> latent (B, N, 3, C) and centred global feature (B, 3, C)."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        c, vn, shared = config.global_channels, config.vector_neurons, config.shared_direction
        self.pre = linear(3, 2 * c, vn)
        self.network0 = nn.ModuleList(VNResNetBlock(2 * c, c, vn, shared) for _ in range(3))
        self.network1 = nn.ModuleList(VNResNetBlock(2 * c, c, vn, shared) for _ in range(2))
        self.global_relu = relu(c, vn, shared)
        self.global_fc = linear(c, c, vn)

    def forward(self, edges: Tensor) -> tuple[Tensor, Tensor]:
        v = self.network0[0](self.pre(edges))
        for block in self.network0[1:]:
            v = block(with_pooled(v))
        latent = v
        for block in self.network1:
            v = block(with_pooled(v))
        pooled = v.mean(1, keepdim=True)
        return latent, self.global_fc(self.global_relu(pooled)).squeeze(1)


class LocalModule(nn.Module):
    """Latent and global feature -> invariant descriptors F^L (B, N, D) (paper, section III-B2)."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        c, n, vn = config.global_channels, config.local_channels, config.vector_neurons
        shared = config.shared_direction
        self.network2 = nn.ModuleList(
            [VNResNetBlock(2 * c, n, vn, shared), VNResNetBlock(2 * n, n, vn, shared)]
        )
        self.invariant: nn.ModuleList | None = None
        if config.invariant_layer:
            self.invariant = nn.ModuleList(
                [
                    VNLinearNormReLU(n, n // 2, shared),
                    VNLinearNormReLU(n // 2, n // 4, shared),
                    nn.Linear(n // 4, 3, bias=False),
                ]
            )
        self.descriptor = nn.Linear(3 * n, config.descriptor_channels, bias=False)
        self.norm = nn.BatchNorm1d(config.descriptor_channels)

    def vectors(self, latent: Tensor, global_feature: Tensor) -> Tensor:
        """The fused equivariant features V, (B, N, 3, L)."""
        expanded = global_feature.unsqueeze(1).expand(-1, latent.shape[1], -1, -1)
        v = self.network2[0](torch.cat([latent, expanded], dim=-1))
        return self.network2[1](with_pooled(v))

    def frame(self, v: Tensor) -> Tensor:
        """Z: three vectors per point, (B, N, 3 coordinates, 3 vectors), equivariant ones unless the
        invariant layer is off: the axes then, with which V Z^T is V.
        """
        if self.invariant is None:
            return torch.eye(3, dtype=v.dtype, device=v.device).expand(*v.shape[:-2], 3, 3)
        for layer in self.invariant:
            v = layer(v)
        return v

    def describe(self, v: Tensor) -> Tensor:
        """V (B, N, 3, L) -> descriptors (B, N, D), through V Z^T when the invariant layer is on."""
        products = v.transpose(-1, -2)  # (B, N, L, 3)
        if self.invariant is not None:
            products = products @ self.frame(v)
        z = self.descriptor(products.flatten(-2))
        return torch.relu(self.norm(z.transpose(1, 2)).transpose(1, 2))

    def forward(self, latent: Tensor, global_feature: Tensor) -> Tensor:
        return self.describe(self.vectors(latent, global_feature))


class FeatureExtractor(nn.Module):
    """Shared encoder: one pass makes the pose-preserving and the pose-invariant features.

    Ablation `shared_encoder = False`: the local module has an encoder of its own (paper, Table V).
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.global_module = GlobalModule(config)
        self.local_module = LocalModule(config)
        self.local_encoder = None if config.shared_encoder else GlobalModule(config)

    def describe(self, edges: Tensor, latent: Tensor, global_feature: Tensor) -> Tensor:
        """Descriptors from the shared (or, in the ablation, the separate) encoder's features."""
        if self.local_encoder is not None:
            latent, global_feature = self.local_encoder(edges)
        return self.local_module(latent, global_feature)
