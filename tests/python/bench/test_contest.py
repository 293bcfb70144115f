"""Exports and runtimes: every one computes what the engine computes, on small random networks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import pytest
import torch
from onnx.reference import ReferenceEvaluator
from vnreg_bench.contest import EQUAL, Worker, largest_error, normalised_error
from vnreg_bench.inputs import bent_box, random_paper_model
from vnreg_bench.runtimes import Task, engine, engine_stages, torch_eager

from vnreg_train.export.descriptor_model import export_descriptor_model
from vnreg_train.export.onnx import export_onnx, load_encoder
from vnreg_train.networks.descriptor import DescriptorNetwork, input_features
from vnreg_train.networks.descriptor_config import DescriptorConfig

POINTS = 150


def random_descriptor_model(path: Path) -> None:
    """Narrow, and with fewer encoded points than a cloud has."""
    torch.manual_seed(3)
    config = DescriptorConfig(channels=9, scalars=12, gates=3, products=2, frames=3)
    network = DescriptorNetwork(config)
    clouds = torch.from_numpy(np.stack(bent_box(POINTS)))
    inputs = input_features(clouds, torch.ones(clouds.shape[:2]), 64, config.moment_radii)
    network.fit_inputs(inputs)
    export_descriptor_model(network.eval(), path, "random", points=POINTS, encoded=100)


@pytest.fixture(scope="module", params=["paper", "vnreg"])
def task(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Task:
    folder = tmp_path_factory.mktemp(request.param)
    model, onnx = folder / "m.vnr", folder / "m.onnx"
    if request.param == "paper":
        random_paper_model(model, 12, POINTS)
    else:
        random_descriptor_model(model)
    export_onnx(load_encoder(model, POINTS), onnx, POINTS)
    clouds = bent_box(POINTS)
    return Task(model, onnx, clouds, engine_stages(model, clouds)[0], threads=1)


def test_torch_computes_what_the_engine_does(task: Task) -> None:
    ours, theirs = engine(task), torch_eager(task)
    assert largest_error(theirs.outputs(), ours.outputs()) < EQUAL
    assert ours.run() > 0
    assert theirs.run() > 0


def test_the_onnx_file_gives_the_same(task: Task) -> None:
    evaluator = ReferenceEvaluator(onnx.load(task.onnx))
    outputs = dict(zip(evaluator.output_names, evaluator.run(None, task.inputs), strict=True))
    assert largest_error(outputs, engine_stages(task.model, task.clouds)[1]) < EQUAL


@pytest.mark.parametrize(
    ("runtime", "package"), [("ONNX Runtime", "onnxruntime"), ("OpenVINO", "openvino")]
)
def test_other_runtimes_in_their_own_process(task: Task, runtime: str, package: str) -> None:
    pytest.importorskip(package, reason="requirements/bench.txt is not installed")
    worker = Worker(runtime, task)
    try:
        outputs = worker.outputs()
        assert worker.time() > 0
    finally:
        worker.close()
    assert largest_error(outputs, engine_stages(task.model, task.clouds)[1]) < EQUAL


def test_a_runtime_that_fails_says_why(task: Task) -> None:
    broken = Task(task.model, task.onnx, task.clouds, {}, 1)
    worker = Worker("torch eager", broken)
    try:
        with pytest.raises(RuntimeError, match="KeyError"):
            worker.outputs()
    finally:
        worker.close()


def test_the_error_is_relative_and_nan_is_the_largest() -> None:
    expected = np.array([3.0, 4.0])
    assert normalised_error([3.0, 4.5], expected) == pytest.approx(0.1)
    assert normalised_error([3.0, np.nan], expected) == float("inf")
    with pytest.raises(KeyError):
        largest_error({}, {"descriptor": expected})
