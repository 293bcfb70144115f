"""Tiny real runs of the parts that need no built program."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
import torch
from vnreg_bench import batch, engine_times, low_precision, machine, waiting
from vnreg_bench.inputs import SHIPPED, bent_box, random_paper_model
from vnreg_bench.settings import Settings

from vnreg_train.model_file import read_model

TINY = Settings(
    rounds=2, sizes=(128, 256), channels=(8, 16), threads=(1,), contest_networks=("vnreg",)
)


@pytest.fixture(autouse=True)
def processors() -> Iterator[None]:
    """Parts pin their process: here it is the tests'."""
    allowed = os.sched_getaffinity(0)
    yield
    os.sched_setaffinity(0, allowed)


def test_time_against_points_has_every_mode_and_size() -> None:
    found = engine_times.time_against_points(TINY)
    expected = {f"{mode}/{n}" for mode in engine_times.MODES for n in TINY.sizes}
    assert set(found["times"]) == set(found["stages"]) == expected
    for key, times in found["times"].items():
        assert times["runs"] == TINY.rounds
        stages = found["stages"][key]
        assert 0 < stages["encode"] < stages["total"]
        assert times["median"] > 0.3 * stages["total"]


def test_threads_are_measured_beside_processes() -> None:
    found = engine_times.time_against_threads(TINY)
    assert set(found["times"]) == {f"{mode}/1" for mode in (*engine_times.MODES, "paper128")}
    alone, together = found["processes"]["alone"], found["processes"]["together"]
    assert len(alone) == len(together) == max(TINY.threads)
    assert min(alone + together) > 0
    kinds = [(of["busy"], of["policy"], of["threads"]) for of in found["waiting"]]
    assert kinds == [(b, p, 1) for b in (0, 1) for p in ("default", "passive")]
    assert all(of["tail"]["runs"] == 10 * TINY.rounds for of in found["waiting"])


@pytest.mark.parametrize("policy", waiting.POLICIES)
def test_processes_started_inside_have_the_policy(
    policy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(machine.WAIT_POLICY, "active")
    with waiting.waiting(policy), get_context("spawn").Pool(1) as process:
        assert process.apply(os.getenv, (machine.WAIT_POLICY, "default")) == policy
    assert os.environ[machine.WAIT_POLICY] == "active"


def test_busy_programs_end() -> None:
    with waiting.busy_programs(2) as programs:
        assert all(program.poll() is None for program in programs)
    assert all(program.poll() is not None for program in programs)


def test_time_grows_with_the_channels() -> None:
    found = engine_times.time_against_channels(replace(TINY, channels=(8, 64)))
    assert found["encode"]["64"] > 3 * found["encode"]["8"]


def test_bent_boxes_are_samples_of_one_surface_turned() -> None:
    source, target = bent_box(500)
    assert source.shape == target.shape == (500, 3)
    assert source.dtype == np.float32
    assert not np.isin(source, target).any()
    spread = [np.sort(np.linalg.svd(c - c.mean(0), compute_uv=False)) for c in (source, target)]
    np.testing.assert_allclose(spread[0], spread[1], rtol=0.1)


def test_random_models_have_the_width_asked_for(tmp_path: Path) -> None:
    random_paper_model(tmp_path / "m.vnr", 24, points=256)
    metadata, tensors = read_model(tmp_path / "m.vnr")
    assert metadata["channels.global"] == 24
    assert metadata["channels.local"] == 12
    assert tensors["encoder.pre"].shape == (48, 3)


def test_rounded_weights_are_those_of_bfloat16(tmp_path: Path) -> None:
    low_precision.round_weights(SHIPPED["vnreg"], tmp_path / "rounded.vnr")
    (metadata, tensors), (_, before) = (
        read_model(tmp_path / "rounded.vnr"),
        read_model(SHIPPED["vnreg"]),
    )
    assert metadata["name"] == "vnreg"
    changed = 0
    for name, values in tensors.items():
        rounded = torch.from_numpy(np.array(values))
        assert torch.equal(rounded.bfloat16().float(), rounded)
        np.testing.assert_allclose(values, before[name], rtol=2**-8)
        changed += int((values != before[name]).sum())
    assert changed > 60_000


def test_batches_of_one_and_two_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("EMPTY_PARTS", "LARGE_PART_ROWS", "TABLE_ROWS", "PART_ROWS"):
        monkeypatch.setattr(batch, name, 3)
    found = batch.batch(replace(TINY, batch_pairs=6, batch_rounds=2))
    assert set(found["ms"]) == {"1", "2"}
    assert found["gain"]["runs"] == 2 and found["gain"]["median"] > 0
    assert found["part_ms"] > 0 and found["client"]["parts"] == 1
    assert found["row_bytes"] > 16 * 8  # a pose alone
