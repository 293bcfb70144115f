"""How good the proposals of the network `vnreg` are, before any judging: figures for experiments.

The pairs are those of one recipe of the training mixture on other shapes; poses play no part.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from vnreg_train.data.mixture import MixtureSampler
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.descriptor import (
    DescriptorNetwork,
    Features,
    input_features,
    split_pair,
)
from vnreg_train.training.descriptor_batches import network_batch
from vnreg_train.training.descriptor_losses import MATCH_RADIUS
from vnreg_train.training.pose_errors import angle_deg, error_figures, pose_errors

TOP = 320  # matches that the engine would look at
ENCODED = 512
GOOD_DEG, GOOD_SHIFT = 15.0, 0.2  # a pose that refinement brings home
PAIRS = 16  # at once


def frame_rotation(source: Tensor, target: Tensor) -> Tensor:
    """The rotations (n, 3, 3) from frames (n, 3, F) to their partners."""
    u, _, vh = torch.linalg.svd(target.double() @ source.double().transpose(1, 2))
    sign = torch.ones_like(u[:, 0])
    sign[:, 2] = torch.det(u @ vh).sign()
    return (u * sign.unsqueeze(1)) @ vh


def match_figures(source: Features, target: Features, x: Tensor, y: Tensor) -> dict[str, float]:
    """Of one pair (no batch dimension); x, y (E, 3) aligned points in network coordinates."""
    local = source.local @ target.local.T
    both = local + source.context @ target.context.T
    figures = {}
    for name, similarity in (("sum", both), ("local", local)):
        worth = torch.softmax(similarity, 0) * torch.softmax(similarity, 1)
        worth = worth * torch.sigmoid(source.significance)[:, None]
        worth = worth * torch.sigmoid(target.significance)[None]
        value, partner = worth.max(1)
        top = value.argsort(descending=True)[: min(TOP, len(value) * 5 // 8)]
        right = (x[top] - y[partner[top]]).norm(dim=1) < MATCH_RADIUS
        figures[f"inliers_{name}"] = float(right.float().mean())
        if name == "sum":
            figures["inliers_first_64"] = float(right[:64].float().mean())
            figures |= pose_figures(source, target, top, partner[top], x, y, right)
    return figures


def pose_figures(
    source: Features,
    target: Features,
    rows: Tensor,
    columns: Tensor,
    x: Tensor,
    y: Tensor,
    right: Tensor,
) -> dict[str, float]:
    """What the poses are worth that single matches (rows, columns) propose by their frames.

    Per kind of frames: the share within 30 degrees where the match is right, whether any pose of
    all matches is good (15 degrees, the centroid of the source within 0.2), and of the first 64;
    and the least rotation error of all whose centroid is in place (180 without such).
    """
    figures = {}
    any_good = torch.zeros(len(rows), dtype=torch.bool)
    least = 180.0
    for name in ("frames_local", "frames_context"):
        rotation = frame_rotation(getattr(source, name)[rows], getattr(target, name)[columns])
        angle = angle_deg(rotation)
        if right.any():
            figures[f"{name}_30"] = float((angle[right] < 30).float().mean())
        centre = x.double().mean(0)
        offset = (rotation @ (centre - x[rows].double()).unsqueeze(2)).squeeze(2)
        placed = (y[columns].double() + offset - centre).norm(dim=1)
        in_place = placed < GOOD_SHIFT
        any_good |= (angle < GOOD_DEG) & in_place
        if in_place.any():
            least = min(least, float(angle[in_place].min()))
    figures["proposed"] = float(any_good.any())
    figures["proposed_first_64"] = float(any_good[:64].any())
    figures["proposed_rotation_deg"] = least
    figures["good_share"] = float(any_good.float().mean())
    return figures


@torch.no_grad()
def validate(
    network: DescriptorNetwork,
    shapes: ShapeSet,
    recipe: str,
    points: int = 1024,
    most_encoded: int = ENCODED,
) -> dict[str, float]:
    """Figures over the shapes, each in one pair of the recipe: shares, and medians of errors."""
    sampler = MixtureSampler(shapes, points, min(PAIRS, len(shapes)), {recipe: 1.0}, seed=7)
    rows: list[dict[str, float]] = []
    coarse = []
    for index in range(len(shapes) // sampler.batch_size):
        pairs = sampler.batch(index)
        encoded = min(most_encoded, int(pairs.source_count.min()), int(pairs.target_count.min()))
        batch = network_batch(pairs)
        inputs = input_features(batch.points, batch.mask, encoded, network.config.moment_radii)
        centres = batch.points[:, :encoded]
        features = network(centres, inputs)
        source, target = split_pair(features)
        rotation, translation = procrustes(
            source.global_feature.transpose(1, 2), target.global_feature.transpose(1, 2)
        )
        coarse.append(pose_errors(rotation, translation - batch.shift))
        x, y = centres.chunk(2)
        x = x + batch.shift.unsqueeze(1)
        for k in range(len(x)):
            one, other = (Features(*(f[k] for f in side)) for side in (source, target))
            rows.append(match_figures(one, other, x[k], y[k]))
    return _over_pairs(rows) | _coarse_figures(torch.cat(coarse))


def _over_pairs(rows: list[dict[str, float]]) -> dict[str, float]:
    """Means of the shares, medians of the angles; of the pairs that have the figure."""
    figures = {}
    for name in sorted({name for row in rows for name in row}):
        values = [row[name] for row in rows if name in row]
        figures[name] = float((np.median if name.endswith("_deg") else np.mean)(values))
    return figures


def _coarse_figures(errors: Tensor) -> dict[str, float]:
    """Of the pose by the global features alone."""
    figures = {f"coarse_{name}": value for name, value in error_figures(errors).items()}
    return figures | {"coarse_15": float((errors[:, 0] < GOOD_DEG).float().mean())}
