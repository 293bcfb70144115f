"""What the machine gives several processors at once: its "processors" may be hardware threads that
share a core, and then no program gains by threads what cores would give."""

from __future__ import annotations

import os
import statistics
from collections.abc import Sequence
from multiprocessing import get_context
from multiprocessing.synchronize import Barrier
from typing import Any

import vnreg
from vnreg_bench.inputs import bent_box
from vnreg_bench.timing import milliseconds

_start: Barrier  # of a worker process


def processes_at_once(processors: Sequence[int], calls: int) -> dict[str, Any]:
    """Median milliseconds of a call in mode verified, one thread, 1,024 points, on each processor:
    one process after the other, then all at the same time."""
    return {
        "alone": [_medians([processor], calls)[0] for processor in processors],
        "together": _medians(processors, calls),
    }


def gain(found: dict[str, Any]) -> float:
    """How many times the calls of one process all of them get through at the same time."""
    return sum(a / t for a, t in zip(found["alone"], found["together"], strict=True))


def _medians(processors: Sequence[int], calls: int) -> list[float]:
    context = get_context("spawn")
    barrier = context.Barrier(len(processors))
    with context.Pool(len(processors), _keep, (barrier,)) as pool:
        return pool.starmap(_median_call, [(p, calls) for p in processors], chunksize=1)


def _keep(barrier: Barrier) -> None:
    global _start
    _start = barrier


def _median_call(processor: int, calls: int) -> float:
    os.sched_setaffinity(0, {processor})
    registrar, pair = vnreg.Registrar(mode="verified", threads=1), bent_box(1024)
    registrar.align(*pair)
    _start.wait()
    return statistics.median(milliseconds(lambda: registrar.align(*pair)) for _ in range(calls))
