"""How fast the paper's network trains here: pairs/s and GFLOP/s of the coarse stage."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from vnreg_train.evaluate.results import cpu_name
from vnreg_train.networks.edges import edge_vectors
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.paper.published import BATCH, EPOCHS, SHAPES
from vnreg_train.training.batches import Batch
from vnreg_train.training.config import TrainingConfig, load_config
from vnreg_train.training.flops import pair_gflop
from vnreg_train.training.stages import CoarseStage

WARM_UP = 1


@dataclass(frozen=True)
class Recipe:
    """One line of the table: a configuration's coarse stage, changed."""

    title: str
    config: str = "small"
    points: int = 512
    batch: int = 16
    shared_direction: bool = True
    compiled: bool = True
    bfloat16: bool = False


RECIPES = (
    Recipe("eager", shared_direction=False, compiled=False),
    Recipe("eager, shared direction", compiled=False),
    Recipe("compiled", shared_direction=False),
    Recipe("compiled, shared direction"),
    Recipe("compiled, shared direction, bf16", bfloat16=True),
    Recipe("compiled, shared direction, bf16, 1,024 points", points=1024, bfloat16=True),
    Recipe("compiled, shared direction, bf16, batch 64", batch=64, bfloat16=True),
)
PAPER = Recipe(
    "the paper's own, eager", "paper", 1024, batch=2, shared_direction=False, compiled=False
)


def measure_training(steps: int, recipes: Sequence[Recipe] = RECIPES) -> dict[str, Any]:
    """The recipes, and what one epoch and the whole of the paper's training would take."""
    before = peak_memory_gib()
    paper = measure_recipe(PAPER, max(2, steps // 2))
    per_pair = (peak_memory_gib() - before) / PAPER.batch
    measured = {recipe.title: measure_recipe(recipe, steps) for recipe in recipes}
    seconds = SHAPES / paper["pairs_per_second"]
    return {
        "cpu": cpu_name(),
        "torch": torch.__version__,
        "threads": torch.get_num_threads(),
        "recipes": measured | {PAPER.title: paper},
        "paper": {
            "shapes": SHAPES,
            "batch": BATCH,
            "epoch_hours": seconds / 3600,
            "all_epochs_days": EPOCHS * seconds / 86400,
            "memory_gib": before + BATCH * per_pair,
        },
    }


def measure_recipe(recipe: Recipe, steps: int) -> dict[str, Any]:
    """Pairs/s (median step, processor time) and GFLOP/s of the matrix products."""
    base = load_config(recipe.config)
    network = replace(base.network, shared_direction=recipe.shared_direction)
    config = replace(base, network=network, data=replace(base.data, points=recipe.points))
    settings = replace(base.coarse, batch=recipe.batch, bfloat16=recipe.bfloat16)
    torch.manual_seed(0)
    stage = CoarseStage(RegistrationNetwork(network), settings, recipe.compiled).train()
    optimizer = torch.optim.AdamW(stage.trainable(), lr=1e-4)
    batch = random_batch(config, recipe.batch)
    seconds = []
    for _ in range(WARM_UP + steps):
        start = time.process_time()
        loss, _ = stage(batch)
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        optimizer.step()
        seconds.append(time.process_time() - start)
    rate = recipe.batch / float(np.median(seconds[WARM_UP:]))
    gflop = pair_gflop(config, "coarse")
    return {
        "points": recipe.points,
        "batch": recipe.batch,
        "pairs_per_second": rate,
        "gflop_per_pair": gflop,
        "gflop_per_second": rate * gflop,
    }


def random_batch(config: TrainingConfig, pairs: int) -> Batch:
    """Of the right shapes: time does not depend on the points."""
    generator = torch.Generator().manual_seed(0)
    points = 0.2 * torch.randn(2 * pairs, config.data.points, 3, generator=generator)
    queries = torch.randn(2 * pairs, config.data.queries, 3, generator=generator)
    means = points + 0.01 * torch.randn(points.shape, generator=generator)
    return Batch(
        points=points,
        edges=edge_vectors(points, means),
        queries=queries,
        occupancies=(queries.norm(dim=2) < 1).float(),
        translation=torch.zeros(pairs, 3),
    )


def peak_memory_gib() -> float:
    """The most memory that this process has held so far."""
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
