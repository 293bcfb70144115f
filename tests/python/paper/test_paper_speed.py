"""What the speeds of the paper's page are made of."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

from torch.utils.flop_counter import FlopCounterMode

sys.path.insert(0, str(Path(__file__).parents[1] / "training"))

from tiny_run import tiny_config

from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.paper.speed import measure_encoders, measure_lines
from vnreg_train.paper.training_speed import Recipe, measure_recipe, random_batch
from vnreg_train.paper.variants import VARIANTS
from vnreg_train.training.flops import pair_gflop
from vnreg_train.training.stages import CoarseStage, FineStage, JointStage


def test_counted_arithmetic_is_that_of_real_steps() -> None:
    """All but the losses' own small matrices."""
    config = tiny_config()
    pairs = 3
    for name, kind in (("coarse", CoarseStage), ("fine", FineStage), ("joint", JointStage)):
        stage = kind(RegistrationNetwork(config.network), getattr(config, name), False)
        with FlopCounterMode(display=False) as counter:
            stage(random_batch(config, pairs))[0].backward()
        real = counter.get_total_flops() / pairs / 1e9
        assert math.isclose(pair_gflop(config, name), real, rel_tol=0.05), name


def test_a_recipe_is_timed() -> None:
    found = measure_recipe(Recipe("tiny", "ablation", points=64, batch=2, compiled=False), 1)
    assert found["pairs_per_second"] > 0 and found["points"] == 64
    rate = found["gflop_per_second"] / found["gflop_per_pair"]
    assert math.isclose(rate, found["pairs_per_second"])


def test_two_encoders_take_longer_than_one() -> None:
    network = replace(tiny_config().network, global_channels=48, local_channels=8)
    found = measure_encoders(network, rounds=5)
    assert found["rounds"] == 5 and found["ratio"] > 1.1
    assert math.isclose(found["ratio"], found["ms"]["two"] / found["ms"]["shared"])


def test_every_line_of_the_ablation_is_timed() -> None:
    """By the engine where it runs the line; one encoder is faster than two."""
    found = measure_lines(tiny_config(), rounds=1)
    assert set(found) == set(VARIANTS)
    by_torch_alone = {name for name, of in found.items() if of["engine"] is None}
    assert by_torch_alone == {"neither", "invariant", "plain_centroids"}
    assert all((of["torch"] or 0) > 0 for of in found.values())
    assert found["tested_candidates"] == found["shared"] != found["both"]
