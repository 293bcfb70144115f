"""What one step of either stage computes: losses and the figures worth watching."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.fine import (
    fine_loss,
    gather_points,
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

Losses = tuple[Tensor, dict[str, Tensor]]


class CoarseStage(nn.Module):
    """Stage 1: shared encoder, coarse register and occupancy decoder."""

    def __init__(self, network: RegistrationNetwork, config: StageConfig, compiled: bool) -> None:
        super().__init__()
        self.network = network
        self.config = config
        self._forward = torch.compile(self._features, dynamic=False) if compiled else self._features

    def trainable(self) -> list[nn.Parameter]:
        modules = (self.network.extractor.global_module, self.network.decoder)
        return [p for module in modules for p in module.parameters()]

    def _features(self, edges: Tensor, queries: Tensor | None) -> tuple[Tensor, Tensor | None]:
        with torch.autocast("cpu", torch.bfloat16, enabled=self.config.bfloat16):
            _, feature = self.network.encode(edges)
            if self.config.occupancy_weight == 0 or queries is None:
                return feature.float(), None
            return feature.float(), self.network.decoder(queries, feature).float()

    def forward(self, batch: Batch) -> Losses:
        feature, logits = self._forward(batch.edges, batch.queries)
        source, target = feature.chunk(2)
        limit = self.config.gradient_limit / len(source)
        rotation, translation = procrustes(
            *(limit_gradient(v, limit).transpose(1, 2) for v in (source, target))
        )
        terms = {"registration": registration_loss(rotation, translation, batch.translation)}
        loss = self.config.registration_weight * terms["registration"]
        if logits is not None and batch.occupancies is not None:
            terms["occupancy"] = occupancy_loss(logits, batch.occupancies)
            loss = loss + self.config.occupancy_weight * terms["occupancy"]
        if self.config.consistency_weight > 0:
            terms["consistency"] = consistency_loss(source, target)
            loss = loss + self.config.consistency_weight * terms["consistency"]
        terms["recall"] = recall(rotation, translation, batch.translation)
        return loss, terms


class FineStage(nn.Module):
    """Stage 2: local module and fine register, on the frozen encoder and coarse register."""

    def __init__(self, network: RegistrationNetwork, config: StageConfig, compiled: bool) -> None:
        super().__init__()
        self.network = network
        self.config = config
        for parameter in network.extractor.global_module.parameters():
            parameter.requires_grad_(False)

        def compile_if(function):  # type: ignore[no-untyped-def]
            return torch.compile(function, dynamic=False) if compiled else function

        self._encode = compile_if(network.encode)
        self._describe = compile_if(network.extractor.describe)
        plain_compare = network.fine.compare

        def compare(*clouds: Tensor) -> tuple[Tensor, Tensor]:
            with self._autocast():
                similarity, row_maxima = plain_compare(*clouds)
            return similarity.float(), row_maxima.float()

        network.fine.compare = compile_if(compare)  # type: ignore[method-assign]

    def _autocast(self) -> torch.autocast:
        return torch.autocast("cpu", torch.bfloat16, enabled=self.config.bfloat16)

    def trainable(self) -> list[nn.Parameter]:
        parts = [self.network.extractor.local_module, self.network.fine]
        if self.network.extractor.local_encoder is not None:
            parts.append(self.network.extractor.local_encoder)
        return [p for part in parts for p in part.parameters()]

    def forward(self, batch: Batch) -> Losses:
        with torch.no_grad():
            latent, feature = self._encode(batch.edges)
            g_source, g_target = feature.transpose(1, 2).chunk(2)
            rotation, translation = procrustes(g_source, g_target)
        with self._autocast():
            descriptors = self._describe(batch.edges, latent, feature).float()
        f_source, f_target = descriptors.chunk(2)
        x, y = batch.points.chunk(2)
        fine = self.network.fine
        keep = x.shape[1] // fine.keep_divisor
        with torch.no_grad():
            truth = x + batch.translation.unsqueeze(1)
            index_x, index_y, is_match = training_candidates(truth, y, keep)
            moved = x @ rotation.transpose(1, 2) + translation.unsqueeze(1)
        f_source, f_target = gather_points(f_source, index_x), gather_points(f_target, index_y)
        steps = fine.run(
            gather_points(moved, index_x), gather_points(y, index_y), f_source, f_target
        )
        score_s = fine.significance(f_source).squeeze(-1)
        score_t = fine.significance(f_target).squeeze(-1)
        terms = fine_loss(steps, score_s, score_t, is_match)
        loss = terms["entropy"] + terms["match"] + terms["weight"]
        last = steps[-1]
        final = last.rotation @ rotation
        moved_t = (last.rotation @ translation.unsqueeze(-1)).squeeze(-1) + last.translation
        terms["recall_coarse"] = recall(rotation, translation, batch.translation)
        terms["recall"] = recall(final, moved_t, batch.translation)
        return loss, terms


@torch.no_grad()
def recall(rotation: Tensor, translation: Tensor, truth: Tensor) -> Tensor:
    """Share of pairs within 5 degrees of the identity and 0.2 of the true translation."""
    identity = torch.eye(3, dtype=rotation.dtype, device=rotation.device)
    chord = torch.linalg.matrix_norm(rotation - identity)  # 2 sqrt(2) sin(angle / 2)
    angle = 2 * torch.rad2deg(torch.asin((chord / 8**0.5).clamp(max=1.0)))
    return ((angle < 5) & ((translation - truth).norm(dim=1) < 0.2)).float().mean()
