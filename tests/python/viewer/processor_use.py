"""How much of the processors other programs use while something is measured (Linux)."""

from __future__ import annotations

import os
import time
from pathlib import Path


def _ticks(stat: str) -> tuple[int, int]:
    """Of a /proc/PID/stat: the parent's number, and the ticks of user and system time."""
    fields = stat.rpartition(")")[2].split()
    return int(fields[1]), int(fields[11]) + int(fields[12])


def _own_ticks() -> int:
    """Of this process and all below it."""
    found: dict[int, tuple[int, int]] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            found[int(folder.name)] = _ticks((folder / "stat").read_text())
        except OSError:  # it has ended
            continue
    own = {os.getpid()}
    while more := {pid for pid, (parent, _) in found.items() if parent in own} - own:
        own |= more
    return sum(ticks for pid, (_, ticks) in found.items() if pid in own)


def _busy_ticks() -> int:
    """Of all processors, since the machine started: user, nice, system, interrupts, stolen."""
    line = Path("/proc/stat").read_text().splitlines()[0].split()[1:]
    values = [int(value) for value in line]
    return sum(values[:3]) + sum(values[5:8])


class OtherPrograms:
    """`with OtherPrograms() as others: ...`; then others.processors, how many they kept busy."""

    processors: float

    def __enter__(self) -> OtherPrograms:
        self._begin = time.monotonic(), _busy_ticks() - _own_ticks()
        return self

    def __exit__(self, *_: object) -> None:
        seconds = time.monotonic() - self._begin[0]
        ticks = _busy_ticks() - _own_ticks() - self._begin[1]
        self.processors = ticks / os.sysconf("SC_CLK_TCK") / seconds
