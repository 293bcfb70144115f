"""Runs everything for a long time in one process and watches its memory.

python tests/soak/soak.py --minutes 60

Pairs of changing sizes in every mode, odd clouds, batches, prepared clouds, cancelled and timed-out
calls, models loaded and dropped, broken models refused. Prints a line now and then; fails where the
resident memory of the last tenth of the time is above that of the second tenth.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import cycle
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import vnreg

Points = NDArray[np.float64]
MODELS = Path(__file__).parents[2] / "models"
REPORTS = 20


def resident_mib() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / 2**20


def cloud(rng: np.random.Generator) -> Points:
    """Of 0 to 3,000 points; now and then a line, a point, or with a NaN."""
    count = int(rng.choice([0, 20, 60, 300, 1024, 3000]))
    points = rng.normal(size=(count, 3)) * rng.uniform(0.1, 1, 3)
    kind = rng.integers(12)
    if kind == 0:
        points[:, 1:] = 0
    elif kind == 1:
        points[:] = 1
    elif kind == 2 and count > 0:
        points[rng.integers(count), rng.integers(3)] = np.nan
    return points


class Work:
    """One of each kind of call per step, and how often each status came."""

    def __init__(self) -> None:
        self.rng = np.random.default_rng(1)
        self.small = vnreg.Model.load(MODELS / "small.vnr")
        self.cancellation = vnreg.Cancellation()
        self.registrars = [
            vnreg.Registrar(threads=1),
            vnreg.Registrar(threads=2, time_budget_ms=5),
            vnreg.Registrar(self.small, mode="paper", threads=1),
            vnreg.Registrar(mode="coarse", threads=1, cancellation=self.cancellation),
        ]
        self.statuses: Counter[str] = Counter()

    def steps(self) -> Iterator[Callable[[], None]]:
        yield from cycle(
            (self.align, self.prepare, self.batch, self.cancel, self.load, self.refuse)
        )

    def align(self) -> None:
        for registrar in self.registrars:
            self.statuses[registrar.align(cloud(self.rng), cloud(self.rng)).status] += 1

    def prepare(self) -> None:
        prepared = self.registrars[0].prepare(cloud(self.rng))
        for _ in range(3):
            self.statuses[self.registrars[0].align(cloud(self.rng), prepared).status] += 1

    def batch(self) -> None:
        pairs = [(cloud(self.rng), cloud(self.rng)) for _ in range(4)]
        for result in vnreg.align_many(pairs, model=self.small, mode="coarse", threads=2):
            self.statuses[result.status] += 1

    def cancel(self) -> None:
        self.cancellation.request()
        self.statuses[self.registrars[3].align(cloud(self.rng), cloud(self.rng)).status] += 1
        self.cancellation.reset()

    def load(self) -> None:
        model = vnreg.Model.load(MODELS / "small.vnr")
        vnreg.Registrar(model, mode="coarse", threads=1)

    def refuse(self) -> None:
        broken = bytearray((MODELS / "small.vnr").read_bytes())
        broken[self.rng.integers(len(broken))] ^= 1
        try:
            vnreg.Model.from_bytes(bytes(broken))
        except vnreg.Error:
            self.statuses["refused model"] += 1


def run(seconds: float) -> bool:
    """Whether the memory stayed where it was."""
    work = Work()
    steps = work.steps()
    begin = time.monotonic()
    resident: list[tuple[float, float]] = []
    while (elapsed := time.monotonic() - begin) < seconds:
        next(steps)()
        if elapsed >= len(resident) * seconds / REPORTS:
            resident.append((elapsed, resident_mib()))
            print(f"{elapsed / 60:6.1f} min {resident[-1][1]:8.1f} MiB", flush=True)
    early = max(mib for at, mib in resident if 0.1 * seconds <= at < 0.25 * seconds)
    late = max(mib for at, mib in resident if at >= 0.85 * seconds)
    print(f"{sum(work.statuses.values())} calls: {dict(work.statuses)}")
    print(f"resident: {early:.1f} MiB early, {late:.1f} MiB late")
    return late <= early + 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60)
    return 0 if run(60 * parser.parse_args().minutes) else 1


if __name__ == "__main__":
    sys.exit(main())
