"""The learning rate of every step: one rise, one fall."""

from __future__ import annotations

from torch.optim import Optimizer
from torch.optim.lr_scheduler import OneCycleLR


def one_cycle(
    optimizer: Optimizer,
    learning_rate: float,
    steps: int,
    warmup: float,
    cycle_momentum: bool = False,
) -> OneCycleLR:
    """`learning_rate` is the largest, reached after the share `warmup` of the steps.

    A rise of just one step is left out: torch divides by its end, 0.
    """
    rises = warmup * steps != 1
    return OneCycleLR(
        optimizer,
        max_lr=learning_rate,
        total_steps=steps,
        pct_start=warmup if rises else 0.0,
        cycle_momentum=cycle_momentum,
    )
