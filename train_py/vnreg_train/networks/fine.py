"""Fine register in the manner of IDAM (paper, section III-D)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
import torch.nn.functional as functional
from torch import Tensor, nn

from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.config import NetworkConfig

Compare = Callable[[Tensor, Tensor, Tensor, Tensor], tuple[Tensor, Tensor]]
MATCH_RADIUS = 0.05  # a true match is closer than this after the true pose


class NormedLinear(nn.Module):
    """Linear without bias, batch norm over all leading dimensions, ReLU (a 1x1 convolution)."""

    def __init__(self, channels_in: int, channels_out: int) -> None:
        super().__init__()
        self.linear = nn.Linear(channels_in, channels_out, bias=False)
        self.bn = nn.BatchNorm1d(channels_out)

    def normalise(self, y: Tensor) -> Tensor:
        """The part behind the linear map."""
        return torch.relu(self.bn(y.flatten(0, -2)).view_as(y))

    def forward(self, x: Tensor) -> Tensor:
        return self.normalise(self.linear(x))


def mlp(*channels: int) -> nn.Sequential:
    """Normed linear layers with ReLU between the widths, a plain linear layer last."""
    hidden = [NormedLinear(i, o) for i, o in zip(channels[:-2], channels[1:-1], strict=True)]
    return nn.Sequential(*hidden, nn.Linear(channels[-2], channels[-1]))


@dataclass
class FineStep:
    """What one iteration computed."""

    similarity: Tensor  # (B, Ks, Kt), clamped to ±20
    match: Tensor  # (B, Ks) positions among the kept target points
    weight_logit: Tensor  # (B, Ks)
    weight: Tensor  # (B, Ks), normalised
    rotation: Tensor  # (B, 3, 3), cumulative over iterations, on top of the coarse pose
    translation: Tensor  # (B, 3)


class FineRegister(nn.Module):
    """Hard elimination, then iterations of distance-aware matching and weighted Procrustes."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        d, p = config.descriptor_channels, config.pair_channels
        self.iterations = config.fine_iterations
        self.keep_divisor = config.keep_divisor
        self.weighted_centroids = config.weighted_centroids
        self.significance = mlp(d, *config.significance_channels, 1)
        self.pair = mlp(2 * d + 4, p, p)
        self.similarity = mlp(p, p, 1)
        self.weight = mlp(p, p, 1)

    def feature_parts(self, features_x: Tensor, features_y: Tensor) -> tuple[Tensor, Tensor]:
        """What the first pair layer makes of the descriptors (B, K, D) of either cloud: (B, K, P).

        The layer is linear in [F_i; F_j; distance; direction], so these parts are computed once for
        all iterations and per point, not per pair.
        """
        weight, d = self._first_pair_weight(), features_x.shape[-1]
        return features_x @ weight[:, :d].T, features_y @ weight[:, d : 2 * d].T

    def _first_pair_weight(self) -> Tensor:
        first = self.pair[0]
        assert isinstance(first, NormedLinear)
        return first.linear.weight

    def compare(
        self, x: Tensor, y: Tensor, part_x: Tensor, part_y: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Kept points (B, K, 3) and parts -> similarity (B, Ks, Kt), row maxima (B, Ks, P).

        The row maxima are those of the pair features over the target's points.
        """
        first = self.pair[0]
        assert isinstance(first, NormedLinear)
        w_distance, w_direction = self._first_pair_weight()[:, -4:].split([1, 3], dim=1)
        difference = x.unsqueeze(2) - y.unsqueeze(1)
        distance = torch.linalg.vector_norm(difference, dim=-1, keepdim=True)
        direction = difference / (distance + 1e-8)
        hidden = part_x.unsqueeze(2) + part_y.unsqueeze(1)
        hidden = hidden + distance @ w_distance.T + direction @ w_direction.T
        features = self.pair[1](first.normalise(hidden))
        similarity = self.similarity(features).squeeze(-1).clamp(-20.0, 20.0)
        return similarity, features.amax(2)

    def step(
        self,
        x: Tensor,
        y: Tensor,
        part_x: Tensor,
        part_y: Tensor,
        compare: Compare | None = None,
    ) -> tuple[FineStep, Tensor, Tensor]:
        """One iteration; returns it (with this step's own pose) and the pose as (R, t)."""
        similarity, row_maxima = (compare or self.compare)(x, y, part_x, part_y)
        weight_logit = self.weight(row_maxima).squeeze(-1)
        match = similarity.argmax(-1)
        weight = torch.sigmoid(weight_logit)
        weight = weight * (weight >= weight.median(-1, keepdim=True).values)
        weight = weight / (weight.sum(-1, keepdim=True) + 1e-8)
        matched = torch.gather(y, 1, match.unsqueeze(-1).expand(-1, -1, 3))
        with torch.no_grad():  # poses are not differentiated; losses act on the matching
            rotation, translation = procrustes(
                x, matched, weight, weighted_centroids=self.weighted_centroids
            )
        step = FineStep(similarity, match, weight_logit, weight, rotation, translation)
        return step, rotation, translation

    def run(
        self,
        x: Tensor,
        y: Tensor,
        features_x: Tensor,
        features_y: Tensor,
        compare: Compare | None = None,
    ) -> list[FineStep]:
        """All iterations on kept points (B, K, 3) and their descriptors (B, K, D).

        The source has been moved by the coarse pose; poses accumulate over the iterations.
        compare: what takes the place of `self.compare`, compiled or in another precision.
        """
        part_x, part_y = self.feature_parts(features_x, features_y)
        steps: list[FineStep] = []
        for _ in range(self.iterations):
            step, rotation, translation = self.step(x, y, part_x, part_y, compare)
            x = x @ rotation.transpose(1, 2) + translation.unsqueeze(1)
            if steps:
                step.rotation = rotation @ steps[-1].rotation
                moved = rotation @ steps[-1].translation.unsqueeze(-1)
                step.translation = moved.squeeze(-1) + translation
            steps.append(step)
        return steps

    def keep(self, descriptors: Tensor) -> tuple[Tensor, Tensor]:
        """Significances (B, N); indices (B, N // keep_divisor) of the largest, descending."""
        score = self.significance(descriptors).squeeze(-1)
        return score, self.most_significant(score)

    def most_significant(self, score: Tensor) -> Tensor:
        """Significances (B, N) -> indices (B, N // keep_divisor) of the largest, descending, equal
        ones by index."""
        order = torch.sort(score, dim=-1, descending=True, stable=True).indices
        return order[:, : score.shape[1] // self.keep_divisor]


def gather_points(values: Tensor, index: Tensor) -> Tensor:
    """Rows `index` (B, K) of values (B, N, ...)."""
    return torch.gather(values, 1, index.unsqueeze(-1).expand(-1, -1, values.shape[-1]))


def training_candidates(
    source: Tensor, target: Tensor, keep: int, generator: torch.Generator | None = None
) -> tuple[Tensor, Tensor, Tensor]:
    """Points that train the matching: half of them with a true match closer than 0.05.

    source (B, N, 3) at the true pose, target (B, M, 3). Returns source indices (B, keep), the
    target's nearest point of each (B, keep), and whether that is a true match (B, keep, float).
    """
    distance, nearest = torch.cdist(source, target).min(2)
    is_match = (distance < MATCH_RADIUS).float()
    positive = torch.multinomial(is_match + 1e-5, keep // 2, generator=generator)
    negative = torch.multinomial(1 + 1e-5 - is_match, keep - keep // 2, generator=generator)
    index = torch.cat([positive, negative], dim=1)
    return index, torch.gather(nearest, 1, index), torch.gather(is_match, 1, index)


def significant_candidates(
    source: Tensor, target: Tensor, index_x: Tensor, index_y: Tensor
) -> tuple[Tensor, Tensor]:
    """Which of the points that elimination kept, as at test time, match: the truth of each.

    source (B, N, 3) at the true pose, target (B, M, 3); indices (B, K) of the kept points. Returns
    the position (B, K) of the nearest kept target point, -1 where that is 0.05 away or more, and
    whether there is one.
    """
    kept = gather_points(source, index_x), gather_points(target, index_y)
    distance, nearest = torch.cdist(*kept).min(2)
    near = distance < MATCH_RADIUS
    return torch.where(near, nearest, -1), near.float()


def fine_loss(
    steps: list[FineStep],
    source_score: Tensor,
    target_score: Tensor,
    is_match: Tensor,
    truth: Tensor | None = None,
) -> dict[str, Tensor]:
    """The three losses of IDAM, summed over iterations.

    source_score, target_score: significances of the candidates (B, K); is_match: (B, K), whether
    there is a true match; truth: (B, K) its position, -1 for none, or None where i matches i.
    """
    first = steps[0].similarity.detach()
    entropy = functional.mse_loss(source_score, negative_entropy(first, -1)) + functional.mse_loss(
        target_score, negative_entropy(first, -2)
    )
    if truth is None:
        truth = torch.arange(first.shape[1], device=first.device).expand(is_match.shape)
    match = torch.zeros((), device=first.device)
    weight = torch.zeros((), device=first.device)
    for step in steps:
        log_probability = torch.log_softmax(step.similarity, -1)
        log_probability = log_probability.gather(2, truth.clamp(min=0).unsqueeze(2)).squeeze(2)
        match = match - (log_probability * is_match).sum() / is_match.sum().clamp(min=1.0)
        label = (step.match == truth).float()
        weight = weight + functional.binary_cross_entropy_with_logits(step.weight_logit, label)
    return {"entropy": entropy, "match": match, "weight": weight}


def negative_entropy(similarity: Tensor, dim: int) -> Tensor:
    """Σ p log p of the softmax along `dim`."""
    log_probability = torch.log_softmax(similarity, dim)
    return (log_probability.exp() * log_probability).sum(dim)
