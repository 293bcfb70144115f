"""What a report was measured on."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = (
    "numpy",
    "torch",
    "onnx",
    "onnxruntime",
    "openvino",
    "open3d-cpu",
    "kiss-matcher",
    "small_gicp",
)
WAIT_POLICY = "OMP_WAIT_POLICY"  # OpenMP looks at it once, when it is loaded
EXTENSIONS = ("avx2", "fma", "avx512f", "avx512_bf16", "amx_bf16")


def describe() -> dict[str, Any]:
    """CPU, operating system and versions; for the JSON."""
    import vnreg

    return {
        "cpu": cpu_field("model name") or platform.processor(),
        "family": f"{cpu_field('cpu family')}, model {cpu_field('model')}",
        "extensions": [name for name in EXTENSIONS if name in cpu_field("flags").split()],
        "cores": len(os.sched_getaffinity(0)),
        "caches": caches(),
        "system": f"{platform.system()} {platform.release().split('-')[0]}, {platform.machine()}",
        "vnreg": vnreg.__version__,
        "instruction_set": vnreg.instruction_set(),
        "python": platform.python_version(),
        "packages": versions(PACKAGES),
    }


def cpu_field(name: str) -> str:
    """A field of the first processor in /proc/cpuinfo; empty where there is none."""
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        key, _, value = line.partition(":")
        if key.strip() == name:
            return value.strip()
    return ""


def caches() -> dict[str, str]:
    """Sizes of the data caches of the first core, as the kernel writes them."""
    found = {}
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        if (index / "type").read_text().strip() != "Instruction":
            level = (index / "level").read_text().strip()
            found[f"L{level}"] = (index / "size").read_text().strip()
    return found


def commit() -> str:
    """Of the checkout; with a + where files differ from it. Empty outside of one."""
    here = Path(__file__).parent
    described = subprocess.run(
        ["git", "describe", "--always", "--dirty=+", "--exclude=*"],
        cwd=here,
        capture_output=True,
        text=True,
        check=False,
    )
    return described.stdout.strip()


def versions(packages: tuple[str, ...]) -> dict[str, str]:
    """Of those that are installed."""
    found = {}
    for package in packages:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def take_priority() -> None:
    """This process and what it starts come before ordinary programs (the real-time class).

    Raises PermissionError where the user may not.
    """
    os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))


def give_up_priority(process: int = 0) -> None:
    """Of this process, or of one that it has started: an ordinary program again."""
    os.sched_setscheduler(process, os.SCHED_OTHER, os.sched_param(0))


def pin(cores: int) -> None:
    """This process runs on the last `cores` of the processors that it may use: the first one serves
    most of the system's interrupts."""
    allowed = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, allowed[-cores:])
