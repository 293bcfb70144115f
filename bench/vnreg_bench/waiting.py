"""What threads cost that wait for each other. OpenMP's spin for a while before they sleep: that is
the faster way on processors that nobody else uses, and takes the processor from the very thread
that is waited for where others do."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

import vnreg
from vnreg_bench.machine import WAIT_POLICY, give_up_priority
from vnreg_bench.timing import WARM_UP, milliseconds, tail

if TYPE_CHECKING:  # else every process would wait for torch
    from vnreg_bench.inputs import Cloud

POLICIES = ("default", "passive")
BUSY = (0, 1)  # programs beside the one that is timed


def cost_of_waiting(
    pair: tuple[Cloud, Cloud], threads: Sequence[int], calls: int
) -> list[dict[str, Any]]:
    """Quantiles of the milliseconds of `calls` calls in mode verified, for every policy, number of
    busy programs on the same processors and number of threads. All at ordinary priority."""
    found = []
    for busy in BUSY:
        for policy in POLICIES:
            with busy_programs(busy), waiting(policy), get_context("spawn").Pool(1) as process:
                for count in threads:
                    times = process.apply(time_calls, (pair, count, calls))
                    found.append(
                        {"busy": busy, "policy": policy, "threads": count, "tail": tail(times)}
                    )
    return found


def time_calls(pair: tuple[Cloud, Cloud], threads: int, calls: int) -> list[float]:
    """Runs in a process that has the policy."""
    give_up_priority()
    registrar = vnreg.Registrar(mode="verified", threads=threads)
    times = [milliseconds(lambda: registrar.align(*pair)) for _ in range(WARM_UP + calls)]
    return times[WARM_UP:]


@contextmanager
def busy_programs(count: int) -> Iterator[list[subprocess.Popen[bytes]]]:
    code = "while True: pass"
    programs = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(count)]
    try:
        for program in programs:
            give_up_priority(program.pid)
        yield programs
    finally:
        for program in programs:
            program.kill()
            program.wait()


@contextmanager
def waiting(policy: str) -> Iterator[None]:
    """Processes that are started inside have the policy."""
    before = os.environ.pop(WAIT_POLICY, None)
    if policy != "default":
        os.environ[WAIT_POLICY] = policy
    try:
        yield
    finally:
        os.environ.pop(WAIT_POLICY, None)
        if before is not None:
            os.environ[WAIT_POLICY] = before
