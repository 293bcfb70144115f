"""What one step of each stage computes: losses and the figures worth watching."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.batches import Batch
from vnreg_train.training.config import StageConfig
from vnreg_train.training.losses import (
    consistency_loss,
    limit_gradient,
    occupancy_loss,
    registration_loss,
)
from vnreg_train.training.matching import Losses, Matching, Pose, compile_if
from vnreg_train.training.pose_errors import pose_errors, recall


class CoarseStage(nn.Module):
    """Stage 1: shared encoder, coarse register and occupancy decoder."""

    def __init__(self, network: RegistrationNetwork, config: StageConfig, compiled: bool) -> None:
        super().__init__()
        self.network = network
        self.config = config
        self._forward = compile_if(compiled, self._features)

    def trainable(self) -> list[nn.Parameter]:
        modules = (self.network.extractor.global_module, self.network.decoder)
        return [p for module in modules for p in module.parameters()]

    def _features(
        self, edges: Tensor, queries: Tensor | None, places: Tensor | None
    ) -> tuple[Tensor, Tensor, Tensor | None]:
        """Latent, global feature, and the decoder's logits where there are labels."""
        with torch.autocast(edges.device.type, torch.bfloat16, enabled=self.config.bfloat16):
            latent, feature = self.network.encode(edges)
            if self.config.occupancy_weight == 0 or queries is None:
                return latent, feature.float(), None
            seen = feature if places is None else feature + places.unsqueeze(2)
            return latent, feature.float(), self.network.decoder(queries, seen).float()

    def forward(self, batch: Batch) -> Losses:
        _, feature, logits = self._forward(batch.edges, batch.queries, batch.places)
        loss, terms, _ = self.losses(feature, logits, batch)
        return loss, terms

    def encode_and_judge(
        self, batch: Batch
    ) -> tuple[Tensor, Tensor, Tensor, dict[str, Tensor], Pose]:
        """For the joint stage: latent, global feature, loss, terms and the coarse pose."""
        latent, feature, logits = self._forward(batch.edges, batch.queries, batch.places)
        loss, terms, pose = self.losses(feature, logits, batch)
        return latent, feature, loss, terms, pose

    def losses(
        self, feature: Tensor, logits: Tensor | None, batch: Batch
    ) -> tuple[Tensor, dict[str, Tensor], Pose]:
        """Loss, its terms and the coarse pose, of the global features (2B, 3, C)."""
        source, target = feature.chunk(2)
        limit = self.config.gradient_limit / len(source)
        rotation, translation = procrustes(
            *(limit_gradient(v, limit).transpose(1, 2) for v in (source, target))
        )
        terms = {"registration": registration_loss(*batch.residual(rotation, translation))}
        loss = self.config.registration_weight * terms["registration"]
        if logits is not None and batch.occupancies is not None:
            terms["occupancy"] = occupancy_loss(logits, batch.occupancies)
            loss = loss + self.config.occupancy_weight * terms["occupancy"]
        if self.config.consistency_weight > 0:
            terms["consistency"] = consistency_loss(batch.turned(source), target)
            loss = loss + self.config.consistency_weight * terms["consistency"]
        terms["recall"] = recall(pose_errors(*batch.residual(rotation, translation)))
        return loss, terms, (rotation, translation)


class FineStage(nn.Module):
    """Stage 2: local module and fine register, on the frozen encoder and coarse register."""

    def __init__(self, network: RegistrationNetwork, config: StageConfig, compiled: bool) -> None:
        super().__init__()
        self.network = network
        self.config = config
        for parameter in network.extractor.global_module.parameters():
            parameter.requires_grad_(False)
        self.matching = Matching(network, config, compiled)
        self._encode = compile_if(compiled, network.encode)

    def trainable(self) -> list[nn.Parameter]:
        return self.matching.trainable()

    def forward(self, batch: Batch) -> Losses:
        bfloat16 = torch.autocast(
            batch.edges.device.type, torch.bfloat16, enabled=self.matching.config.bfloat16
        )
        with torch.no_grad():
            with bfloat16:
                latent, feature = self._encode(batch.edges)
            feature = feature.float()
            g_source, g_target = feature.transpose(1, 2).chunk(2)
            pose = procrustes(g_source, g_target)
        return self.matching(batch, latent, feature, pose)


class JointStage(nn.Module):
    """Ours: after both stages, everything at once, so that the latent learns to match points."""

    def __init__(self, network: RegistrationNetwork, config: StageConfig, compiled: bool) -> None:
        super().__init__()
        self.config = config
        self.coarse = CoarseStage(network, config, compiled)
        self.matching = Matching(network, config, compiled)

    def trainable(self) -> list[nn.Parameter]:
        return self.coarse.trainable() + self.matching.trainable()

    def forward(self, batch: Batch) -> Losses:
        latent, feature, loss, coarse_terms, (rotation, translation) = self.coarse.encode_and_judge(
            batch
        )
        pose = rotation.detach(), translation.detach()
        matching, terms = self.matching(batch, latent, feature, pose)
        coarse_terms.pop("recall")
        return loss + self.config.matching_weight * matching, coarse_terms | terms
