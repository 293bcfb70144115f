"""The curves of a run, read back from TensorBoard's event files as TensorBoard shows them."""

from __future__ import annotations

import math
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

sys.path.insert(0, str(Path(__file__).parent))

from test_descriptor_train import tiny_config as tiny_descriptor_config
from tiny_run import bent_boxes, tiny_config

from vnreg_train.training.descriptor_train import DescriptorTrainer
from vnreg_train.training.loop import Trainer
from vnreg_train.training.train import StageTrainer

Points = list[tuple[int, float]]
AnyTrainer = Trainer[Any, Any]
TIMES = "speed/pairs_per_second"  # of what two runs need not share


def of_the_descriptor(folder: Path) -> AnyTrainer:
    config = replace(tiny_descriptor_config(), log_steps=2, validation_steps=4)
    return DescriptorTrainer(config, bent_boxes(8), folder, bent_boxes(4))


def of_stage(stage: str, folder: Path) -> AnyTrainer:
    config = replace(tiny_config(), log_steps=2, validation_steps=4)
    return StageTrainer(config, stage, bent_boxes(8), folder, validation=bent_boxes(4))


def of_the_coarse_stage(folder: Path) -> AnyTrainer:
    return of_stage("coarse", folder)


def of_the_fine_stage(folder: Path) -> AnyTrainer:
    if not (folder / "coarse.pt").exists():
        of_the_coarse_stage(folder).save()
    return of_stage("fine", folder)


Maker = Callable[[Path], AnyTrainer]
MAKERS = [of_the_descriptor, of_the_coarse_stage, of_the_fine_stage]


def curves(run: AnyTrainer) -> dict[str, Points]:
    """(step, value) of every point that TensorBoard shows, by the curve's name."""
    events = EventAccumulator(str(run.run_folder / "tensorboard" / run.name))
    events.Reload()
    return {
        tag: [(event.step, event.value) for event in events.Scalars(tag)]
        for tag in events.Tags()["scalars"]
    }


def without_times(found: dict[str, Points]) -> dict[str, Points]:
    return {name: points for name, points in found.items() if not name.startswith("speed/")}


@pytest.mark.parametrize("make", MAKERS)
def test_every_curve_is_there(tmp_path: Path, make: Maker) -> None:
    run = make(tmp_path)
    run.run(progress=False)
    steps = run.settings.steps
    found = curves(run)
    logged = {
        "train/loss",
        "optimiser/learning_rate",
        "optimiser/gradient_norm",
        "optimiser/skipped",
        "weights/norm",
        "weights/average_norm",
        "weights/average_distance",
        TIMES,
    }
    assert logged < set(found)
    for name, points in found.items():
        every = 4 if name.startswith("validation/") else 2
        assert [step for step, _ in points] == list(range(every, steps + 1, every)), name
        assert all(math.isfinite(value) for _, value in points), name
    assert all(value > 0 for _, value in found[TIMES])
    assert any(name.endswith("recall") for name in found if name.startswith("validation/"))
    assert any(name.endswith("rotation_deg") for name in found if name.startswith("validation/"))


@pytest.mark.parametrize("make", MAKERS)
def test_a_run_killed_after_its_checkpoint_goes_on_without_doubled_steps(
    tmp_path: Path, make: Maker
) -> None:
    whole = make(tmp_path / "whole")
    whole.run(progress=False)
    killed = make(tmp_path / "killed")
    killed.run(max_minutes=0.0, progress=False)
    assert killed.step == 1
    shutil.copy(killed.checkpoint, tmp_path / "old")
    make(tmp_path / "killed").run(progress=False)  # writes to the end, but its checkpoints are lost
    shutil.copy(tmp_path / "old", killed.checkpoint)
    again = make(tmp_path / "killed")
    again.run(progress=False)
    expected, got = curves(whole), curves(again)
    assert [step for step, _ in got[TIMES]] == list(range(2, whole.settings.steps + 1, 2))
    assert without_times(got) == without_times(expected)


def test_a_curve_tells_what_the_steps_gave(tmp_path: Path) -> None:
    config = tiny_descriptor_config()
    expected = DescriptorTrainer(config, bent_boxes(8), tmp_path / "steps")
    figures = [expected.train_step(batch) for batch in expected._batches()]
    run = of_the_descriptor(tmp_path / "run")
    run.run(progress=False)
    found = curves(run)
    for k, (step, value) in enumerate(found["train/loss"]):
        mean = (figures[2 * k]["loss"] + figures[2 * k + 1]["loss"]) / 2
        assert step == 2 * k + 2 and value == pytest.approx(mean, rel=1e-6)
    distance = [value for _, value in found["weights/average_distance"]]
    assert all(value > 0 for value in distance)
    assert found["optimiser/skipped"][-1][1] == 0


def test_validation_changes_nothing(tmp_path: Path) -> None:
    with_validation = of_the_fine_stage(tmp_path / "with")
    with_validation.run(progress=False)
    config = replace(tiny_config(), validation_steps=0)
    shutil.copytree(tmp_path / "with", tmp_path / "without")
    (tmp_path / "without" / "fine.pt").unlink()
    without = StageTrainer(config, "fine", bent_boxes(8), tmp_path / "without")
    without.run(progress=False)
    for one, other in zip(
        with_validation.network.parameters(), without.network.parameters(), strict=True
    ):
        assert one.equal(other)
