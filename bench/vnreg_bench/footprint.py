"""Sizes of what is installed, and the time of a process that starts, loads and aligns once."""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from vnreg_bench.inputs import bent_box
from vnreg_bench.machine import pin
from vnreg_bench.settings import Settings
from vnreg_bench.timing import interleaved, milliseconds, summary

NOT_SURE = 4


def footprint(settings: Settings) -> dict[str, Any]:
    """Bytes of the stripped library with its built-in model; milliseconds of cold processes.

    A process counts from its start to its end, files in the page cache: `align` reads two clouds
    of 1,024 points, makes a registrar with the built-in model, aligns, prints; `version` does none
    of it. `first_align` is what the engine tells of that first call, the registrar not included.
    """
    pin(1)
    program = settings.build / "vnreg"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for side, cloud in zip(("source", "target"), bent_box(1024), strict=True):
            np.save(folder / f"{side}.npy", cloud)
        files = [str(folder / f"{side}.npy") for side in ("source", "target")]
        align = [str(program), "align", *files, "--threads", "1", "--json"]
        times = interleaved(
            {
                "align": lambda: milliseconds(lambda: _run(align)),
                "version": lambda: milliseconds(lambda: _run([str(program), "--version"])),
            },
            settings.rounds,
        )
        first = [json.loads(_run(align))["ms"]["total"] for _ in range(9)]
        size = stripped_size(_library(settings.build), folder)
    return {
        "library_bytes": size,
        "cold": {key: summary(t) for key, t in times.items()},
        "first_align": summary(first),
    }


def _run(command: list[str]) -> str:
    """Output of a program that may say that it is not sure of the pose (docs/cli.md)."""
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode not in (0, NOT_SURE):
        raise RuntimeError(f"{' '.join(command)}: exit code {done.returncode}: {done.stderr}")
    return done.stdout


def _library(build: Path) -> Path:
    found = next(iter(sorted(build.rglob("libvnreg.so"))), None)
    if found is None:
        raise FileNotFoundError(f"{build}: no libvnreg.so; run `make build`")
    return found.resolve()


def stripped_size(library: Path, folder: Path) -> int:
    """Bytes of the library without symbols that nothing at run time needs."""
    out = folder / library.name
    subprocess.run(["strip", "--strip-unneeded", "-o", str(out), str(library)], check=True)
    return out.stat().st_size
