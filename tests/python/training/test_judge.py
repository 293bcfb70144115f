"""The judge: its loss, its training, its place in the model file, and the engine's copy of it."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import torch

import vnreg
from vnreg_train.model_file import read_model
from vnreg_train.networks.judge import FIRST_POINTS, MOST_POINTS, POINT_INPUTS, JudgeNetwork
from vnreg_train.training.judge_samples import (
    KEPT_POINTS,
    MOST_POSES,
    JudgeSamples,
    collect_samples,
)
from vnreg_train.training.judge_train import (
    KEY,
    JudgeTraining,
    judge_loss,
    train_judge,
    write_judge,
)

MODEL = Path("models/vnreg.vnr")


def random_judge(seed: int, hidden: int = 12) -> JudgeNetwork:
    torch.manual_seed(seed)
    network = JudgeNetwork(hidden)
    network.fit_inputs(torch.randn(200, POINT_INPUTS) * 2 + 1)
    return network.eval()


def samples(pairs: int, seed: int) -> JudgeSamples:
    """Poses of which those with a small first input are right; some pairs have fewer, or none."""
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 1, (pairs, MOST_POSES, 2 * KEPT_POINTS, POINT_INPUTS))
    there = np.arange(MOST_POSES) < rng.integers(1, MOST_POSES + 1, (pairs, 1))
    right = there & (rng.random((pairs, MOST_POSES)) < 0.25)
    points[..., 0] += np.where(right, -0.5, 0.5)[..., None]
    fit = rng.normal(0, 1, (pairs, MOST_POSES)).astype(np.float32)
    return JudgeSamples(points.astype(np.float16), fit, right, there)


def cloud(count: int, seed: int) -> np.ndarray:
    """On three faces of a box and a rod: no symmetry."""
    rng = np.random.default_rng(seed)
    sides = np.array([1.0, 0.7, 0.45])
    points = rng.uniform(0, 1, (count, 3)) * sides
    points[np.arange(count), rng.integers(0, 3, count)] = 0
    rod = rng.random(count) < 0.15
    points[rod] = [0.8, 0.1, 0] + rng.uniform(0, 1, (rod.sum(), 1)) * [0.1, 0.5, 0.6]
    return points


def test_folded_tensors_are_the_same_network() -> None:
    network = random_judge(3)
    again = JudgeNetwork.from_tensors(network.tensors()).eval()
    points, fit = torch.randn(5, 2 * FIRST_POINTS, POINT_INPUTS), torch.randn(5)
    with torch.no_grad():
        torch.testing.assert_close(again(points, fit), network(points, fit), rtol=1e-4, atol=1e-4)


def test_loss_falls_when_the_right_pose_rises() -> None:
    right = torch.tensor([[False, True, False], [False, False, False]])
    there = torch.tensor([[True, True, True], [True, True, False]])
    low = torch.tensor([[1.0, 0.0, 0.5], [-1.0, -1.0, 9.0]])
    high = low.clone()
    high[0, 1] = 3.0
    assert judge_loss(high, right, there) < judge_loss(low, right, there)
    # What is not there does not count.
    other = low.clone()
    other[1, 2] = -50.0
    assert judge_loss(other, right, there) == judge_loss(low, right, there)


def test_training_learns_what_tells_right_from_wrong() -> None:
    network = train_judge(
        samples(120, 0), JudgeTraining(hidden=8, steps=150, batch=8), progress=False
    )
    held_out = samples(60, 1)
    with torch.no_grad():
        z = network(torch.from_numpy(held_out.points).float(), torch.from_numpy(held_out.fit))
    z = np.where(held_out.there, z.numpy(), -np.inf)
    decidable = held_out.right.any(1) & ~held_out.right.all(1)
    chosen = held_out.right[np.arange(len(z)), z.argmax(1)]
    assert chosen[decidable].mean() > 0.9


def test_training_refuses_samples_without_a_right_pose() -> None:
    empty = samples(4, 2)
    empty.right[:] = False
    with pytest.raises(ValueError, match="no pair has a right pose"):
        train_judge(empty, JudgeTraining(steps=1), progress=False)


def test_write_replaces_the_judge_alone(tmp_path: Path) -> None:
    network = random_judge(4)
    out = tmp_path / "judged.vnr"
    write_judge(MODEL, out, network)
    metadata, tensors = read_model(out)
    before, others = read_model(MODEL)
    assert metadata[KEY] == 12
    assert not [key for key in metadata if key.startswith("calibration.verified.")]
    for name, tensor in others.items():
        if not name.startswith("judge."):
            np.testing.assert_array_equal(tensors[name], tensor)
    for name, tensor in network.tensors().items():
        np.testing.assert_array_equal(tensors[name], tensor)
    assert {k: v for k, v in before.items() if not k.startswith(("calibration.", KEY))}.items() <= (
        metadata.items()
    )


DOUBT = 6.0  # below the best log-odds: poses that the engine looks at closer


def torch_log_odds(
    judge: JudgeNetwork, inputs: np.ndarray, fit: np.ndarray, split: int, most: int
) -> np.ndarray:
    """By the first `most` points of each cloud; of the inputs (K, P, 33) the first `split` are of
    the source."""
    points = np.arange(inputs.shape[1])
    chosen = np.concatenate([points[:split][:most], points[split:][:most]])
    with torch.no_grad():
        return judge(torch.from_numpy(inputs[:, chosen]), torch.from_numpy(fit)).numpy()


def assert_close(got: np.ndarray, expected: np.ndarray) -> None:
    assert np.abs(got - expected).max() <= 1e-4 * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("count", [40, 300, 1024])
def test_engine_and_torch_judge_alike(tmp_path: Path, count: int) -> None:
    path = tmp_path / "judged.vnr"
    write_judge(MODEL, path, random_judge(5))
    registrar = vnreg.Registrar(
        vnreg.Model.load(path), mode="verified", threads=1, record_stages=True
    )
    source, target = cloud(count, 1), cloud(count, 2)
    result = registrar.align(source, target)
    assert result.has_pose
    stages = registrar.stages()
    fit = np.asarray(stages["judge.fit"], np.float32)
    inputs = np.asarray(stages["judge.inputs"], np.float32).reshape(len(fit), -1, POINT_INPUTS)
    assert np.isfinite(inputs).all()
    judge = JudgeNetwork.from_tensors(read_model(path)[1])
    split = int(stages["judge.source_points"].item())
    first = torch_log_odds(judge, inputs, fit, split, FIRST_POINTS)
    assert_close(np.asarray(stages["judge.first_log_odds"]).ravel(), first)
    closer = torch_log_odds(judge, inputs, fit, split, MOST_POINTS)
    expected = first.copy()
    close = [i for i in np.argsort(-first)[:4] if first[i] > first.max() - DOUBT]
    if len(close) > 1:
        expected = np.minimum(first, closer[close].min())
        expected[close] = closer[close]
    assert_close(np.asarray(stages["judge.log_odds"]).ravel(), expected)


def test_engine_refuses_a_judge_of_another_shape(tmp_path: Path) -> None:
    from vnreg_train.model_file import write_model

    metadata, tensors = read_model(MODEL)
    tensors |= random_judge(6).tensors()
    write_model(tmp_path / "wrong.vnr", metadata | {KEY: 13}, tensors)
    with pytest.raises(vnreg.Error, match=r"judge\.point\.0"):
        vnreg.Model.load(tmp_path / "wrong.vnr")


def test_poses_between_different_shapes_are_wrong(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    with h5py.File(tmp_path / "train.h5", "w") as file:
        file["data"] = np.stack([cloud(4096, s) * rng.uniform(0.5, 1, 3) for s in (1, 2, 3)])
        file["label"] = np.zeros((3, 1), np.int64)
        file["names"] = ["a", "b", "c"]
    found = collect_samples(
        MODEL, "train", ["P1/noise_0.01"], [0], {}, tmp_path, shapes=[0, 2], different=3
    )
    assert len(found) == 5
    assert found.there[:, 0].all() and np.isfinite(found.points).all()
    assert found.right[:2].any() and not found.right[2:].any()
