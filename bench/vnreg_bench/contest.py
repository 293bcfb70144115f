"""Same weights, same inputs, same processors: the engine's encoders beside other runtimes.

Each runtime lives in a process of its own and waits there for its turn, so that no thread pool
disturbs another's; the turns are interleaved.
"""

from __future__ import annotations

import os
import tempfile
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from vnreg_bench.inputs import SHIPPED, bent_box, random_paper_model
from vnreg_bench.machine import pin
from vnreg_bench.runtimes import FULL_PRECISION, RUNTIMES, Arrays, Task, engine_stages
from vnreg_bench.settings import Settings
from vnreg_bench.timing import interleaved, summary
from vnreg_train.export.onnx import export_onnx, load_encoder

POINTS = 1024
# Largest normalised error at which two float32 results count as the same: the sums run in other
# orders.
EQUAL = 1e-3


def contest(settings: Settings) -> dict[str, Any]:
    """Milliseconds of every network, runtime and number of threads; and how equal the outputs are.

    Raises RuntimeError where a runtime's outputs are not the engine's: its time would mean nothing.
    """
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in settings.contest_networks:
            model, onnx = prepare_network(name, Path(folder), POINTS)
            by_threads = {
                str(threads): run_contest(model, onnx, POINTS, threads, settings.rounds)
                for threads in settings.threads
            }
            found[name] = by_threads
    return {"points": POINTS, "equal_within": EQUAL, "networks": found}


def prepare_network(name: str, folder: Path, points: int) -> tuple[Path, Path]:
    """Model file and ONNX file of `vnreg`, `small`, or `paper` (C = 128, random weights)."""
    model, onnx = SHIPPED.get(name, folder / f"{name}.vnr"), folder / f"{name}.onnx"
    if name not in SHIPPED:
        random_paper_model(model, 128, points)
    export_onnx(load_encoder(model, points), onnx, points)
    return model, onnx


def run_contest(
    model: Path,
    onnx: Path,
    points: int,
    threads: int,
    rounds: int,
    runtimes: Sequence[str] = FULL_PRECISION,
    within: float = EQUAL,
) -> dict[str, dict[str, Any]]:
    """Of one network: per runtime a summary of its times, and `error` against the engine.

    Raises RuntimeError where an error is not below `within`.
    """
    clouds = bent_box(points)
    inputs, expected = engine_stages(model, clouds)
    task = Task(model, onnx, clouds, inputs, threads)
    workers = {name: Worker(name, task) for name in runtimes}
    try:
        errors = {name: largest_error(w.outputs(), expected) for name, w in workers.items()}
        for name, error in errors.items():
            if not error < within:
                raise RuntimeError(f"{model.name}: outputs of {name} differ by {error:.2g}")
        times = interleaved({name: w.time for name, w in workers.items()}, rounds)
    finally:
        for worker in workers.values():
            worker.close()
    return {name: {**summary(t), "error": errors[name]} for name, t in times.items()}


def normalised_error(values: Any, expected: Any) -> float:
    """|values - expected| / |expected| in the Euclidean norm; infinite where a value is NaN."""
    difference = np.linalg.norm(np.asarray(values, np.float64) - expected)
    error = difference / max(float(np.linalg.norm(np.asarray(expected, np.float64))), 1e-30)
    return float(error) if np.isfinite(error) else float("inf")


def largest_error(outputs: Arrays, expected: Arrays) -> float:
    """Over all outputs. Raises KeyError for one that is missing."""
    return max(normalised_error(outputs[name], value) for name, value in expected.items())


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set while a process is started, which inherits it."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


class Worker:
    """A runtime in a process with as many processors as the task has threads."""

    def __init__(self, runtime: str, task: Task) -> None:
        context = get_context("spawn")
        self._connection, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(runtime, task, other), daemon=True)
        with _environment({"OMP_NUM_THREADS": str(task.threads), "OMP_WAIT_POLICY": "passive"}):
            self._process.start()
        other.close()

    def outputs(self) -> Arrays:
        return self._ask("outputs")

    def time(self) -> float:
        """Milliseconds of one run, behind one that brings code and weights back into the caches."""
        return self._ask("time")

    def _ask(self, what: str) -> Any:
        self._connection.send(what)
        answer = self._connection.recv()
        if isinstance(answer, str):
            raise RuntimeError(answer)
        return answer

    def close(self) -> None:
        self._connection.close()
        self._process.join()


def _serve(runtime: str, task: Task, connection: Connection) -> None:
    """Answers until the other end closes; a failure is answered with its traceback."""
    try:
        pin(task.threads)
        runner = RUNTIMES[runtime](task)
        while True:
            if connection.recv() == "outputs":
                connection.send(runner.outputs())
            else:
                runner.run()
                connection.send(runner.run())
    except EOFError:
        return
    except Exception:
        connection.send(traceback.format_exc())
