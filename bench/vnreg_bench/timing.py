"""How times are taken and summed up."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np

WARM_UP = 3
TAIL = {"p50": 0.5, "p95": 0.95, "p99": 0.99, "p99.9": 0.999}
Times = list[float]


def milliseconds(run: Callable[[], object]) -> float:
    """Wall time of one call."""
    started = time.perf_counter()
    run()
    return 1e3 * (time.perf_counter() - started)


def rest(ms: float) -> None:
    """Behind every timed call. In the real-time class, the kernel interrupts what takes more than
    95 % of a processor for 50 ms; so a part of it is left to others, outside of measured time."""
    if os.sched_getscheduler(0) == os.SCHED_RR:
        time.sleep(2e-4 * ms)


def interleaved(
    work: Mapping[str, Callable[[], float]], rounds: int, pause_s: float = 0
) -> dict[str, Times]:
    """What every function returns (its milliseconds), `rounds` times: each round calls each once,
    so that whatever else the machine does meets all alike. The first rounds are left out. A pause
    behind every call lets its threads sleep, which would slow the next one while they spin."""
    times: dict[str, Times] = {label: [] for label in work}
    for round_number in range(-WARM_UP, rounds):
        for label, run in work.items():
            ms = run()
            rest(ms)
            if pause_s > 0:
                time.sleep(pause_s)
            if round_number >= 0:
                times[label].append(ms)
    return times


def summary(times: Sequence[float]) -> dict[str, float]:
    """Median, quartiles, shortest, and how many; for the JSON."""
    first, median, third = np.quantile(times, [0.25, 0.5, 0.75])
    return {
        "median": float(median),
        "q1": float(first),
        "q3": float(third),
        "min": float(np.min(times)),
        "runs": len(times),
    }


def tail(times: Sequence[float]) -> dict[str, float]:
    """Quantiles of a latency: the smallest time that so large a share does not exceed."""
    values = np.quantile(times, list(TAIL.values()), method="inverted_cdf")
    return dict(zip(TAIL, (float(v) for v in values), strict=True)) | {"runs": len(times)}


def histogram(times: Sequence[float], bins: int = 80) -> dict[str, list[float]]:
    """Counts in bins of equal ratio between shortest and longest time."""
    low, high = min(times), max(times)
    edges = np.geomspace(low, max(high, low * 1.001), bins + 1)
    edges[0], edges[-1] = low, max(high, edges[-1])
    counts, _ = np.histogram(times, edges)
    return {"edges": [float(e) for e in edges], "counts": [int(c) for c in counts]}
