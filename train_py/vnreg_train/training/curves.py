"""The curves of a run: TensorBoard's event files, which `tensorboard --logdir runs` shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from torch import nn
from torch.utils.tensorboard import SummaryWriter


class Curves:
    """Writes points into a folder, from a step on.

    A run that was killed has written more than its last checkpoint knows of. Going on from there
    withdraws what came after the checkpoint, so that no step has two points.
    """

    def __init__(self, folder: Path, step: int) -> None:
        self._writer = SummaryWriter(str(folder), purge_step=step + 1)

    def add(self, group: str, figures: Mapping[str, float], step: int) -> None:
        """One point on the curve GROUP/NAME of each figure."""
        for name, value in figures.items():
            self._writer.add_scalar(f"{group}/{name}", value, step)

    def close(self) -> None:
        self._writer.close()


def mean_figures(steps: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Of each figure its mean over the steps; at least one."""
    return {name: float(np.mean([step[name] for step in steps])) for name in steps[0]}


@torch.no_grad()
def weight_figures(network: nn.Module, average: nn.Module) -> dict[str, float]:
    """Lengths of all weights as one vector and of their average, and how far they are apart."""
    own, mean = (nn.utils.parameters_to_vector(m.parameters()) for m in (network, average))
    return {
        "norm": float(own.norm()),
        "average_norm": float(mean.norm()),
        "average_distance": float((own - mean).norm()),
    }
