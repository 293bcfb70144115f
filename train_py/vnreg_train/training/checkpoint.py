"""Everything a stopped run needs to go on as if it had not stopped."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import torch
from torch import nn
from torch.optim import Optimizer
from torch.optim.lr_scheduler import LRScheduler
from torch.optim.swa_utils import AveragedModel


def save_checkpoint(path: Path, **parts: Any) -> None:
    """Writes the parts atomically: a run that is killed while saving keeps its last checkpoint."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(".tmp")
    torch.save(parts, temporary)
    os.replace(temporary, path)


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Its parts, in this processor's memory, wherever they were trained."""
    parts: dict[str, Any] = torch.load(path, map_location="cpu", weights_only=True)
    return parts


def training_state(
    stage: str,
    step: int,
    network: nn.Module,
    average: AveragedModel,
    optimizer: Optimizer,
    schedule: LRScheduler,
    config: dict[str, Any],
) -> dict[str, Any]:
    """The parts of a checkpoint; `ema` are the weights to evaluate and export."""
    return {
        "stage": stage,
        "step": step,
        "network": network.state_dict(),
        "ema": average.module.state_dict(),
        "ema_updates": average.n_averaged,
        "optimizer": optimizer.state_dict(),
        "schedule": schedule.state_dict(),
        "torch_rng": torch.get_rng_state(),
        "config": config,
    }


def restore_training_state(
    state: dict[str, Any],
    network: nn.Module,
    average: AveragedModel,
    optimizer: Optimizer,
    schedule: LRScheduler,
) -> int:
    """Puts a checkpoint's state back; returns the step to go on with."""
    network.load_state_dict(state["network"])
    average.module.load_state_dict(state["ema"])
    average.n_averaged.copy_(state["ema_updates"])
    optimizer.load_state_dict(state["optimizer"])
    # Where the schedule stands is the checkpoint's, how long it is the configuration's: the same
    # configuration goes on to the bit, a shorter or longer one bends the rest of the curve.
    length = ("total_steps", "_schedule_phases")
    schedule.load_state_dict({k: v for k, v in state["schedule"].items() if k not in length})
    torch.set_rng_state(state["torch_rng"])
    return int(state["step"])
