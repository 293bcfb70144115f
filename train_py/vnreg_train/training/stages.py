"""What one step of each stage computes: losses and the figures worth watching."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.fine import (
    fine_loss,
    gather_points,
    significant_candidates,
    training_candidates,
)
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.batches import Batch
from vnreg_train.training.config import StageConfig
from vnreg_train.training.losses import (
    consistency_loss,
    limit_gradient,
    occupancy_loss,
    registration_loss,
)
from vnreg_train.training.pose_errors import pose_errors, recall

Losses = tuple[Tensor, dict[str, Tensor]]
Pose = tuple[Tensor, Tensor]


def _compile_if(compiled: bool, function: Callable[..., Any]) -> Callable[..., Any]:
    return torch.compile(function, dynamic=False) if compiled else function


class CoarseStage(nn.Module):
    """Stage 1: shared encoder, coarse register and occupancy decoder."""

    def __init__(self, network: RegistrationNetwork, config: StageConfig, compiled: bool) -> None:
        super().__init__()
        self.network = network
        self.config = config
        self._forward = _compile_if(compiled, self._features)

    def trainable(self) -> list[nn.Parameter]:
        modules = (self.network.extractor.global_module, self.network.decoder)
        return [p for module in modules for p in module.parameters()]

    def _features(
        self, edges: Tensor, queries: Tensor | None, places: Tensor | None
    ) -> tuple[Tensor, Tensor, Tensor | None]:
        """Latent, global feature, and the decoder's logits where there are labels."""
        with torch.autocast("cpu", torch.bfloat16, enabled=self.config.bfloat16):
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
        self._encode = _compile_if(compiled, network.encode)

    def trainable(self) -> list[nn.Parameter]:
        return self.matching.trainable()

    def forward(self, batch: Batch) -> Losses:
        with torch.no_grad():
            latent, feature = self._encode(batch.edges)
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


@dataclass
class Candidates:
    """Which points are matched, (B, K) each: indices into the clouds, whether a source point has a
    true match, and where that is among the target's (-1: nowhere; None: point i matches point i).
    """

    source: Tensor
    target: Tensor
    is_match: Tensor
    truth: Tensor | None


class Matching(nn.Module):
    """Local module and fine register, from the encoder's features and the coarse pose."""

    def __init__(self, network: RegistrationNetwork, config: StageConfig, compiled: bool) -> None:
        super().__init__()
        self.network = network
        self.config = config
        self._describe = _compile_if(compiled, network.extractor.describe)
        self._compare = _compile_if(compiled, self._compare_in_float32)

    def _compare_in_float32(self, *clouds: Tensor) -> tuple[Tensor, Tensor]:
        with self._autocast():
            similarity, row_maxima = self.network.fine.compare(*clouds)
        return similarity.float(), row_maxima.float()

    def _autocast(self) -> torch.autocast:
        return torch.autocast("cpu", torch.bfloat16, enabled=self.config.bfloat16)

    def trainable(self) -> list[nn.Parameter]:
        parts: list[nn.Module] = [self.network.extractor.local_module, self.network.fine]
        if self.network.extractor.local_encoder is not None:
            parts.append(self.network.extractor.local_encoder)
        return [p for part in parts for p in part.parameters()]

    def forward(self, batch: Batch, latent: Tensor, feature: Tensor, pose: Pose) -> Losses:
        with self._autocast():
            descriptors = self._describe(batch.edges, latent, feature).float()
        x, y = batch.points.chunk(2)
        chosen = self._candidates(batch.at_truth(x), y, descriptors)
        rotation, translation = pose
        moved = x @ rotation.transpose(1, 2) + translation.unsqueeze(1)
        f_source, f_target = descriptors.chunk(2)
        steps = self.network.fine.run(
            gather_points(moved, chosen.source),
            gather_points(y, chosen.target),
            gather_points(f_source, chosen.source),
            gather_points(f_target, chosen.target),
            self._compare,
        )
        scores = self._significances(descriptors, chosen)
        terms = fine_loss(steps, *scores, chosen.is_match, chosen.truth)
        loss = terms["entropy"] + terms["match"] + terms["weight"]
        last = steps[-1]
        final = last.rotation @ rotation
        moved_t = (last.rotation @ translation.unsqueeze(-1)).squeeze(-1) + last.translation
        terms["recall_coarse"] = recall(pose_errors(*batch.residual(rotation, translation)))
        terms["recall"] = recall(pose_errors(*batch.residual(final, moved_t)))
        return loss, terms

    @torch.no_grad()
    def _candidates(self, source: Tensor, target: Tensor, descriptors: Tensor) -> Candidates:
        """The points that are matched; source (B, N, 3) is at the true pose."""
        fine = self.network.fine
        keep = source.shape[1] // fine.keep_divisor
        index_x, index_y, is_match = training_candidates(source, target, keep)
        drawn = Candidates(index_x, index_y, is_match, None)
        if self.config.tested_share == 0:
            return drawn
        kept_x, kept_y = fine.keep(descriptors)[1].chunk(2)
        truth, has_match = significant_candidates(source, target, kept_x, kept_y)
        as_tested = torch.rand(len(source), 1) < self.config.tested_share
        return Candidates(
            torch.where(as_tested, kept_x, index_x),
            torch.where(as_tested, kept_y, index_y),
            torch.where(as_tested, has_match, is_match),
            torch.where(as_tested, truth, torch.arange(keep)),
        )

    def _significances(self, descriptors: Tensor, chosen: Candidates) -> tuple[Tensor, Tensor]:
        """Significances (B, K) of the candidates of either cloud.

        Where elimination takes part, its network sees all points, as it does at test time, so that
        its batch norm learns their statistics.
        """
        fine = self.network.fine
        if self.config.tested_share == 0:
            source, target = descriptors.chunk(2)
            kept = gather_points(source, chosen.source), gather_points(target, chosen.target)
            return fine.significance(kept[0]).squeeze(-1), fine.significance(kept[1]).squeeze(-1)
        source, target = fine.significance(descriptors).squeeze(-1).chunk(2)
        return source.gather(1, chosen.source), target.gather(1, chosen.target)
