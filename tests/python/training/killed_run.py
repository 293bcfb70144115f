"""Trains the tiny run in this process and saves after every step: what a test kills."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from tiny_run import tiny_config, trainer

from vnreg_train.training.config import TrainingConfig

KILLED_STEPS = 60


def killed_config() -> TrainingConfig:
    """The tiny run, long enough to be killed in its midst on a busy machine."""
    config = tiny_config()
    stage = replace(config.coarse, steps=KILLED_STEPS)
    return replace(config, checkpoint_minutes=0.0, coarse=stage)


if __name__ == "__main__":
    trainer(Path(sys.argv[1]), "coarse", killed_config()).run(progress=False)
