"""The encoders under the engine and under other runtimes, all with one interface.

Every function here makes a Runner from a Task. It is called in a process of its own, whose
environment and processors have been set for the task's number of threads.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

import vnreg
from vnreg_bench.inputs import Cloud
from vnreg_bench.timing import milliseconds
from vnreg_train.evaluate.methods import Mode
from vnreg_train.export.onnx import load_encoder
from vnreg_train.model_file import read_model

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Task:
    """A model file, its ONNX twin, a pair of clouds, and what the encoder takes of them."""

    model: Path
    onnx: Path
    clouds: tuple[Cloud, Cloud]
    inputs: Arrays  # of the encoder, both clouds in one batch
    threads: int


@dataclass(frozen=True)
class Runner:
    """run: encodes both clouds once, returns milliseconds. outputs: what it made of them."""

    run: Callable[[], float]
    outputs: Callable[[], Arrays]


def engine(task: Task) -> Runner:
    """The time that the engine takes for its stage `encode`."""
    use = encoding_registrar(task.model, len(task.clouds[0]), task.threads)
    return Runner(
        lambda: use.align(*task.clouds).ms["encode"],
        lambda: engine_stages(task.model, task.clouds)[1],
    )


def encoding_registrar(
    model: Path, points: int, threads: int = 1, record: bool = False
) -> vnreg.Registrar:
    """In the mode that runs the whole encoder and as little else as there is: mode coarse runs the
    network `vnreg` as a whole, but only half of the paper's."""
    mode: Mode = "coarse" if read_model(model)[0]["arch"] == "vnreg" else "paper"
    loaded = vnreg.Model.load(model)
    return vnreg.Registrar(
        loaded, mode=mode, threads=threads, max_points=points, record_stages=record
    )


def engine_stages(model: Path, clouds: tuple[Cloud, Cloud]) -> tuple[Arrays, Arrays]:
    """The encoder's inputs as the engine prepares them, and its outputs; in torch's layouts."""
    recorder = encoding_registrar(model, len(clouds[0]), record=True)
    recorder.align(*clouds)
    stages = recorder.stages()
    sides = [
        {name.removeprefix(f"{side}."): value for name, value in stages.items() if side in name}
        for side in ("source", "target")
    ]
    make = _descriptor_stages if "source.encoded" in stages else _paper_stages
    inputs, outputs = zip(*(make(side) for side in sides), strict=True)
    return _batch(inputs), _batch(outputs)


def _batch(sides: tuple[Arrays, ...]) -> Arrays:
    return {
        name: np.ascontiguousarray(np.stack([s[name] for s in sides]), dtype=np.float32)
        for name in sides[0]
    }


def _paper_stages(stages: Mapping[str, NDArray[Any]]) -> tuple[Arrays, Arrays]:
    inputs = {"edge": stages["edge"].transpose(0, 2, 1)}
    return inputs, {
        "global": stages["global"].T,
        "descriptor": stages["descriptor"],
        "significance": stages["significance"],
    }


def _descriptor_stages(stages: Mapping[str, NDArray[Any]]) -> tuple[Arrays, Arrays]:
    """The encoded points go first."""
    points, encoded = stages["points"], stages["encoded"].astype(int)
    others = np.setdiff1d(np.arange(len(points)), encoded)
    outputs = {
        name: stages[name]
        for name in ("descriptor.local", "descriptor.context", "significance", "overlap")
    }
    for name in ("frames.local", "frames.context"):
        frames = stages[name]
        outputs[name] = frames.reshape(len(frames), -1, 3).transpose(0, 2, 1)
    outputs["global"] = stages["global"].T
    return {"points": points[np.concatenate([encoded, others])]}, outputs


def torch_eager(task: Task) -> Runner:
    return _torch_runner(task, lambda encoder: encoder)


def torch_compile(task: Task) -> Runner:
    """Inductor with weights frozen as constants, as for deployment."""
    return _torch_runner(
        task, lambda encoder: torch.compile(encoder, dynamic=False, options={"freezing": True})
    )


def _torch_runner(task: Task, prepare: Callable[[Any], Any]) -> Runner:
    torch.set_num_threads(task.threads)
    encoder = load_encoder(task.model, len(task.clouds[0]))
    use = prepare(encoder)
    inputs = [torch.from_numpy(task.inputs[name]) for name in encoder.input_names]

    def forward() -> tuple[torch.Tensor, ...]:
        with torch.no_grad():
            return tuple(use(*inputs))

    def outputs() -> Arrays:
        named = zip(encoder.output_names, forward(), strict=True)
        return {name: value.numpy() for name, value in named}

    return Runner(lambda: milliseconds(forward), outputs)


def onnx_runtime(task: Task) -> Runner:
    import onnxruntime  # type: ignore[import-untyped]  # it has no types

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = task.threads
    options.inter_op_num_threads = 1
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL
    session = onnxruntime.InferenceSession(
        str(task.onnx), options, providers=["CPUExecutionProvider"]
    )
    names = [output.name for output in session.get_outputs()]
    return Runner(
        lambda: milliseconds(lambda: session.run(None, task.inputs)),
        lambda: dict(zip(names, session.run(None, task.inputs), strict=True)),
    )


def openvino(task: Task) -> Runner:
    return _openvino_runner(task, "f32")


def openvino_bf16(task: Task) -> Runner:
    """In the precision that OpenVINO prefers where the processor multiplies bfloat16."""
    return _openvino_runner(task, "bf16")


def _openvino_runner(task: Task, precision: str) -> Runner:
    import openvino as ov  # type: ignore[import-untyped]  # it has no types

    core = ov.Core()
    compiled = core.compile_model(
        core.read_model(task.onnx),
        "CPU",
        {
            "INFERENCE_NUM_THREADS": str(task.threads),
            "PERFORMANCE_HINT": "LATENCY",
            "INFERENCE_PRECISION_HINT": precision,
            "ENABLE_CPU_PINNING": "NO",  # the process is pinned
        },
    )
    request = compiled.create_infer_request()

    def outputs() -> Arrays:
        made = request.infer(task.inputs)
        return {output.any_name: np.array(made[output]) for output in compiled.outputs}

    return Runner(lambda: milliseconds(lambda: request.infer(task.inputs)), outputs)


RUNTIMES: dict[str, Callable[[Task], Runner]] = {
    "engine": engine,
    "torch eager": torch_eager,
    "torch.compile": torch_compile,
    "ONNX Runtime": onnx_runtime,
    "OpenVINO": openvino,
    "OpenVINO bf16": openvino_bf16,
}
FULL_PRECISION = tuple(name for name in RUNTIMES if name != "OpenVINO bf16")
