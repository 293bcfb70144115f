"""The paper's network on shapes that it was not trained on."""

from __future__ import annotations

import torch

from vnreg_train.data.resample import TrainingSampler
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.fine import gather_points
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.batches import Batch, BatchSequence
from vnreg_train.training.config import TrainingConfig
from vnreg_train.training.pose_errors import error_figures, pose_errors

SEED = 7
PAIRS = 16  # at once
Poses = tuple[torch.Tensor, torch.Tensor]  # rotations (B, 3, 3), translations (B, 3)


@torch.no_grad()
def validate_stage(
    network: RegistrationNetwork, shapes: ShapeSet, config: TrainingConfig, fine: bool
) -> dict[str, float]:
    """Recall and median errors of the coarse pose, and of the final one where `fine`.

    One pair a shape, of the settings that the configuration trains on, whole batches of PAIRS; the
    network in evaluation mode. Translations are in network coordinates.
    """
    data = config.data
    batch = min(PAIRS, len(shapes))
    sampler = TrainingSampler(
        shapes,
        data.points,
        batch,
        data.settings,
        seed=SEED,
        queries=0,
        diagonal_crops=data.diagonal_crops,
    )
    sequence = BatchSequence(
        sampler,
        neighbours=data.neighbours or config.network.neighbours,
        rms_radius=config.network.input_rms_radius,
        turn=True,
        steps=len(shapes) // batch,
        apart=not config.network.equivariant,
    )
    device = next(network.parameters()).device
    coarse, final = [], []
    for index in range(len(sequence)):
        pairs = sequence[index].to(device)
        poses = stage_poses(network, pairs, fine)
        coarse.append(pose_errors(*pairs.residual(*poses[0])))
        final.append(pose_errors(*pairs.residual(*poses[-1])))
    figures = error_figures(torch.cat(final))
    if fine:
        figures |= {f"coarse_{k}": v for k, v in error_figures(torch.cat(coarse)).items()}
    return figures


def stage_poses(network: RegistrationNetwork, batch: Batch, fine: bool) -> list[Poses]:
    """The coarse poses, then, where `fine`, those of the last iteration."""
    latent, feature = network.encode(batch.edges)
    rotation, translation = procrustes(*feature.transpose(1, 2).chunk(2))
    if not fine:
        return [(rotation, translation)]
    register = network.fine
    f_source, f_target = network.extractor.describe(batch.edges, latent, feature).chunk(2)
    x, y = batch.points.chunk(2)
    _, kept_x = register.keep(f_source)
    _, kept_y = register.keep(f_target)
    moved = x @ rotation.transpose(1, 2) + translation.unsqueeze(1)
    last = register.run(
        gather_points(moved, kept_x),
        gather_points(y, kept_y),
        gather_points(f_source, kept_x),
        gather_points(f_target, kept_y),
    )[-1]
    turned = (last.rotation @ translation.unsqueeze(-1)).squeeze(-1)
    return [(rotation, translation), (last.rotation @ rotation, turned + last.translation)]
