"""A training run small enough for a test: made-up shapes, a narrow network, the real loop."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from vnreg_train.data.shapes import ShapeSet
from vnreg_train.networks.config import NetworkConfig
from vnreg_train.training.config import DataConfig, StageConfig, TrainingConfig
from vnreg_train.training.train import StageTrainer

STEPS = 12


def bent_boxes(count: int, points: int = 400) -> ShapeSet:
    """Points on boxes of random sides, bent, so that no two axes look alike; labels by the box."""
    rng = np.random.default_rng(0)
    surface = rng.uniform(-0.5, 0.5, (count, points, 3)) * rng.uniform(0.4, 1.0, (count, 1, 3))
    axis = rng.integers(0, 3, (count, points, 1))
    np.put_along_axis(surface, axis, np.sign(rng.normal(size=axis.shape)) * 0.3, axis=2)
    surface[..., 2] += 0.4 * surface[..., 0] ** 2
    queries = rng.uniform(-0.6, 0.6, (count, 64, 3))
    return ShapeSet(
        surface=surface.astype(np.float32),
        label=np.zeros(count, dtype=np.int64),
        names=tuple(f"box{i}" for i in range(count)),
        categories=("box",),
        queries=queries.astype(np.float32),
        occupancies=(np.abs(queries).max(-1) < 0.3).astype(np.uint8),
    )


def tiny_config() -> TrainingConfig:
    stage = StageConfig(
        steps=STEPS, batch=4, learning_rate=1e-3, consistency_weight=1.0, gradient_limit=10.0
    )
    return TrainingConfig(
        name="tiny",
        threads=1,
        compile=False,
        network=NetworkConfig(
            global_channels=8,
            local_channels=8,
            descriptor_channels=8,
            pair_channels=8,
            significance_channels=(8, 4),
            neighbours=8,
            input_rms_radius=0.33,
            decoder_width=16,
        ),
        data=DataConfig(points=96, queries=32, settings={"half": 1.0, "partial": 1.0}),
        coarse=replace(stage, scaled_start=True),
        fine=stage,
        joint=stage,
    )


def trainer(folder: Path, stage: str, config: TrainingConfig | None = None) -> StageTrainer:
    return StageTrainer(config or tiny_config(), stage, bent_boxes(8), folder)


def train_steps(run: StageTrainer, count: int) -> list[dict[str, float]]:
    """So many steps from where the run stands, without the loader's process."""
    return [run.train_step(run.batches[run.step]) for _ in range(count)]
