"""What both later stages train: local module and fine register, on points that are matched."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from vnreg_train.networks.fine import (
    FineStep,
    fine_loss,
    gather_points,
    significant_candidates,
    training_candidates,
)
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.batches import Batch
from vnreg_train.training.config import StageConfig
from vnreg_train.training.pose_errors import pose_errors, recall

Losses = tuple[Tensor, dict[str, Tensor]]
Pose = tuple[Tensor, Tensor]  # rotations (B, 3, 3), translations (B, 3)


def compile_if(compiled: bool, function: Callable[..., Any]) -> Callable[..., Any]:
    return torch.compile(function, dynamic=False) if compiled else function


@dataclass
class Candidates:
    """Which points are matched, (B, K) each: indices into the clouds, whether a source point has a
    true match, and where that is among the target's (-1: nowhere; None: point i matches point i).
    """

    source: Tensor
    target: Tensor
    is_match: Tensor
    truth: Tensor | None


def moved(points: Tensor, pose: Pose) -> Tensor:
    """Points (B, N, 3) at a pose."""
    rotation, translation = pose
    return points @ rotation.transpose(1, 2) + translation.unsqueeze(1)


def composed(step: FineStep, pose: Pose) -> Pose:
    """The pose after a step that started from `pose`."""
    rotation, translation = pose
    turned = (step.rotation @ translation.unsqueeze(-1)).squeeze(-1)
    return step.rotation @ rotation, turned + step.translation


class Matching(nn.Module):
    """Local module and fine register, from the encoder's features and the coarse pose."""

    def __init__(self, network: RegistrationNetwork, config: StageConfig, compiled: bool) -> None:
        super().__init__()
        self.network = network
        self.config = config
        self._describe = compile_if(compiled, network.extractor.describe)
        self._compare = compile_if(compiled, self._compare_in_float32)

    def _compare_in_float32(self, *clouds: Tensor) -> tuple[Tensor, Tensor]:
        with self._autocast(clouds[0]):
            similarity, row_maxima = self.network.fine.compare(*clouds)
        return similarity.float(), row_maxima.float()

    def _autocast(self, where: Tensor) -> torch.autocast:
        return torch.autocast(where.device.type, torch.bfloat16, enabled=self.config.bfloat16)

    def trainable(self) -> list[nn.Parameter]:
        parts: list[nn.Module] = [self.network.extractor.local_module, self.network.fine]
        if self.network.extractor.local_encoder is not None:
            parts.append(self.network.extractor.local_encoder)
        return [p for part in parts for p in part.parameters()]

    def forward(self, batch: Batch, latent: Tensor, feature: Tensor, pose: Pose) -> Losses:
        with self._autocast(latent):
            descriptors = self._describe(batch.edges, latent, feature).float()
        x, y = batch.points.chunk(2)
        chosen = self._candidates(batch.at_truth(x), y, descriptors)
        f_source, f_target = descriptors.chunk(2)
        kept = gather_points(x, chosen.source), gather_points(y, chosen.target)
        features = gather_points(f_source, chosen.source), gather_points(f_target, chosen.target)
        start = self._unrolled(*kept, *features, pose)
        steps = self.network.fine.run(moved(kept[0], start), kept[1], *features, self._compare)
        scores = self._significances(descriptors, chosen)
        terms = fine_loss(steps, *scores, chosen.is_match, chosen.truth)
        loss = terms["entropy"] + terms["match"] + terms["weight"]
        final = composed(steps[-1], start)
        terms["recall_coarse"] = recall(pose_errors(*batch.residual(*pose)))
        terms["recall"] = recall(pose_errors(*batch.residual(*final)))
        return loss, terms

    @torch.no_grad()
    def _unrolled(self, x: Tensor, y: Tensor, f_x: Tensor, f_y: Tensor, pose: Pose) -> Pose:
        """The pose after a random number of iterations that are not trained on, so that what is
        trained meets poses as near as those of later iterations.
        """
        if self.config.unrolled == 0:
            return pose
        count = int(torch.randint(self.config.unrolled + 1, (), device="cpu"))
        fine = self.network.fine
        parts = fine.feature_parts(f_x, f_y)
        for _ in range(count):
            step, _, _ = fine.step(moved(x, pose), y, *parts, self._compare)
            pose = composed(step, pose)
        return pose

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
        as_tested = torch.rand(len(source), 1, device=source.device) < self.config.tested_share
        return Candidates(
            torch.where(as_tested, kept_x, index_x),
            torch.where(as_tested, kept_y, index_y),
            torch.where(as_tested, has_match, is_match),
            torch.where(as_tested, truth, torch.arange(keep, device=source.device)),
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
