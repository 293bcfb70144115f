"""Training of the network `vnreg`: resuming, coordinates, losses that fall, losses that mean it."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

sys.path.insert(0, str(Path(__file__).parent))

from tiny_run import bent_boxes

from vnreg_train.data.mixture import RECIPES, MixtureSampler
from vnreg_train.networks.descriptor import unit_frames
from vnreg_train.networks.descriptor_config import DescriptorConfig
from vnreg_train.training.config import config_arch
from vnreg_train.training.descriptor_batches import network_batch
from vnreg_train.training.descriptor_config import (
    DescriptorOptimisationConfig,
    DescriptorTrainingConfig,
    MixtureConfig,
    load_descriptor_config,
    parse_descriptor_config,
)
from vnreg_train.training.descriptor_losses import (
    determinacy,
    frame_loss,
    hits,
    matching_loss,
    soft_targets,
)
from vnreg_train.training.descriptor_train import DescriptorTrainer
from vnreg_train.training.descriptor_validation import validate

STEPS = 8
WEIGHTS = load_descriptor_config("vnreg").optimisation.weights


def tiny_config() -> DescriptorTrainingConfig:
    return DescriptorTrainingConfig(
        name="tiny",
        compile=False,
        network=DescriptorConfig(channels=8, scalars=8, gates=2, products=2, global_channels=8),
        data=MixtureConfig(points=48, encoded=24, mixture={"clean": 1.0, "partial_75_noisy": 1.0}),
        optimisation=DescriptorOptimisationConfig(
            steps=STEPS, batch=4, learning_rate=1e-2, bfloat16=False, weights=WEIGHTS
        ),
    )


def trainer(folder: Path, config: DescriptorTrainingConfig | None = None) -> DescriptorTrainer:
    return DescriptorTrainer(config or tiny_config(), bent_boxes(8), folder)


def train_steps(run: DescriptorTrainer, count: int) -> list[dict[str, float]]:
    return [run.train_step(network_batch(run.sampler.batch(run.step))) for _ in range(count)]


def test_a_resumed_run_equals_an_unbroken_one_to_the_bit(tmp_path: Path) -> None:
    whole = trainer(tmp_path / "whole")
    figures = train_steps(whole, STEPS)
    first = trainer(tmp_path / "broken")
    before = train_steps(first, 3)
    first.save()
    second = trainer(tmp_path / "broken")
    assert second.step == 3
    assert figures == before + train_steps(second, STEPS - 3)
    for a, b in zip(
        whole.average.state_dict().values(), second.average.state_dict().values(), strict=True
    ):
        assert torch.equal(a, b)


def test_the_loop_stops_saves_and_goes_on(tmp_path: Path) -> None:
    run = trainer(tmp_path)
    run.run(max_minutes=0.0, progress=False)
    assert run.step == 1 and run.checkpoint.exists()
    again = trainer(tmp_path)
    again.run(progress=False)
    assert again.step == STEPS
    assert list((tmp_path / "tensorboard" / "vnreg").glob("events*"))


def test_training_reduces_the_loss(tmp_path: Path) -> None:
    config = tiny_config()
    config = replace(config, optimisation=replace(config.optimisation, steps=150))
    figures = train_steps(trainer(tmp_path, config), 150)
    first, last = (
        sum(f["match"] + f["match_local"] for f in part) for part in (figures[:20], figures[-20:])
    )
    assert last < 0.95 * first


def test_a_gradient_that_is_not_finite_changes_nothing(tmp_path: Path) -> None:
    run = trainer(tmp_path)
    batch = network_batch(run.sampler.batch(0))
    batch.points[0, 0, 0] = math.nan
    before = [p.detach().clone() for p in run.network.parameters()]
    run.train_step(batch)
    assert run.skipped == 1
    assert all(torch.equal(a, b) for a, b in zip(before, run.network.parameters(), strict=True))


def test_one_step_of_the_shipped_configuration(tmp_path: Path) -> None:
    config = replace(load_descriptor_config("vnreg"), compile=False)
    config = replace(config, optimisation=replace(config.optimisation, batch=2))
    run = DescriptorTrainer(config, bent_boxes(2, points=8192), tmp_path)
    figures = train_steps(run, 1)[0]
    assert all(math.isfinite(value) for value in figures.values()) and run.skipped == 0


def test_both_clouds_get_one_scale_and_the_shift_aligns_them() -> None:
    pairs = MixtureSampler(bent_boxes(8), 48, 4, {"clean": 1.0}, 0).batch(0)
    batch = network_batch(pairs)
    x, y = batch.points.chunk(2)
    radius = (batch.points.square().sum(2).sum(1) / batch.mask.sum(1)).sqrt().reshape(2, -1)
    torch.testing.assert_close(radius.amax(0), torch.ones(4))
    moved = x + batch.shift.unsqueeze(1)
    gaps = torch.cdist(moved.double(), y.double()).amin(2)
    assert float((gaps * batch.mask[:4]).max()) < 1e-5


def test_padding_stays_at_zero_and_out_of_the_mask() -> None:
    pairs = MixtureSampler(bent_boxes(8), 48, 4, {"partial_75": 1.0}, 0).batch(0)
    batch = network_batch(pairs)
    counts = np.concatenate([pairs.source_count, pairs.target_count])
    assert batch.mask.sum(1).tolist() == counts.tolist()
    assert float((batch.points * (1 - batch.mask).unsqueeze(2)).abs().max()) == 0


def test_the_matching_loss_rewards_the_right_matches() -> None:
    points = torch.rand(1, 30, 3) * 3
    distance, worth = soft_targets(points, points)
    right, wrong = 20 * torch.eye(30)[None], 20 * torch.eye(30).roll(1, 0)[None]
    assert matching_loss(right, worth) < 1.0 < 5.0 < matching_loss(wrong, worth)
    assert hits(right, distance, 2).all() and not hits(wrong, distance, 2).all()


def test_points_without_counterpart_do_not_count() -> None:
    points = torch.rand(1, 20, 3)
    far = torch.cat([points, points + 50], 1)
    similarity = torch.randn(1, 40, 20)
    _, worth = soft_targets(far, points)
    changed = similarity.clone()
    changed[:, 20:] = torch.randn(1, 20, 20) - 30  # below all others, in either softmax
    low = similarity.clone()
    low[:, 20:] = -30.0
    torch.testing.assert_close(
        matching_loss(changed, worth), matching_loss(low, worth), atol=1e-4, rtol=0
    )


def test_frames_that_agree_cost_little_and_parallel_ones_much() -> None:
    worth = torch.eye(5)[None]
    spread = torch.linalg.qr(torch.randn(5, 3, 3))[0][None] / 3**0.5
    parallel = torch.zeros(1, 5, 3, 3)
    parallel[..., 0, :] = 3**-0.5
    assert float(determinacy(spread)[0, 0]) == pytest.approx(2 / 3, abs=1e-5)
    assert float(determinacy(parallel)[0, 0]) == pytest.approx(0, abs=1e-5)
    assert float(frame_loss(spread, spread, worth)) == pytest.approx(0, abs=1e-6)
    noise = 0.05 * torch.randn_like(spread)
    bad, good = (
        frame_loss(frames, unit_frames(frames + noise), worth) for frames in (parallel, spread)
    )
    assert bad > 2 * good > 0


def test_validation_figures_are_shares(tmp_path: Path) -> None:
    run = trainer(tmp_path)
    figures = validate(run.average.module.eval(), bent_boxes(8), "clean", points=48)
    assert {"inliers_sum", "inliers_local", "coarse_15"} <= set(figures)
    assert all(0 <= value <= 1 for value in figures.values())


def test_configurations_say_which_network_they_are_for() -> None:
    assert config_arch("vnreg") == "vnreg" and config_arch("paper") == "paper"
    assert set(load_descriptor_config("vnreg").data.mixture) <= set(RECIPES)
    with pytest.raises(ValueError, match="arch"):
        parse_descriptor_config('name = "x"')
    with pytest.raises(ValueError, match="speed"):
        parse_descriptor_config('arch = "vnreg"\n[optimisation]\nspeed = 3')
