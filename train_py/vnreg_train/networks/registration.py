"""The whole network: shared encoder, coarse register, fine register (paper, figure 2a)."""

from __future__ import annotations

from torch import Tensor, nn

from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.decoder import OccupancyDecoder
from vnreg_train.networks.encoder import FeatureExtractor
from vnreg_train.networks.fine import FineRegister


class RegistrationNetwork(nn.Module):
    """Holds the parts; `training` and `reference` say how they are put to work."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.extractor = FeatureExtractor(config)
        self.fine = FineRegister(config)
        self.decoder = OccupancyDecoder(config)

    def encode(self, edges: Tensor) -> tuple[Tensor, Tensor]:
        """Edge vectors (B, N, 3, 3) -> latent (B, N, 3, C), centred global feature (B, 3, C)."""
        latent, global_feature = self.extractor.global_module(edges)
        return latent, global_feature
