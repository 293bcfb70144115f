"""Runs the Google Benchmark programs and reads what they say."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from vnreg_bench.machine import pin
from vnreg_bench.settings import Settings
from vnreg_bench.timing import summary

# Benchmarks of more than one thread, whose processes are not pinned to one.
PARALLEL = "/2/manual_time$"
NANOSECONDS = {"ns": 1.0, "us": 1e3, "ms": 1e6, "s": 1e9}
ROOF = "roof/"
RATES = ("GFLOP/s", "GB/s", "share")


def kernels(settings: Settings) -> dict[str, Any]:
    """Every kernel and both encoders against the roofline, one row a benchmark."""
    program = settings.build / "kernels_bench"
    repeated = (
        f"--benchmark_repetitions={settings.kernel_repetitions}",
        "--benchmark_enable_random_interleaving=true",
        "--benchmark_min_time=0.05",
    )
    if settings.kernel_filter == ".":
        found = [
            run_benchmarks(program, (*repeated, f"--benchmark_filter=-{PARALLEL}"), cores=1),
            run_benchmarks(program, (*repeated, f"--benchmark_filter={PARALLEL}"), cores=2),
        ]
    else:
        chosen = f"--benchmark_filter={settings.kernel_filter}|{ROOF}"
        found = [run_benchmarks(program, (*repeated, chosen), cores=1)]
    context = found[0]["context"]
    rows = [row for one in found for row in benchmark_rows(one["benchmarks"])]
    roof = [row for row in rows if row["name"].startswith(ROOF)]
    return {
        "compiler": context["compiler"],
        "instruction_set": context["instruction set"],
        "roof": {
            row["bound"]: row["GFLOP/s" if row["bound"] == "product" else "GB/s"]
            for row in sorted(roof, key=lambda row: row["name"] != f"{ROOF}product")
        },
        "rows": against_roof([row for row in rows if row not in roof], roof),
    }


def against_roof(
    rows: Sequence[dict[str, Any]], roof: Sequence[dict[str, Any]]
) -> list[dict[str, Any]]:
    """The programs count shares of the roofline of their start; these are of the same roofline
    measured among the benchmarks, in turns with them."""
    now = {row["bound"]: row["share"] for row in roof}
    return [{**row, "share": row["share"] / now[row["bound"]]} for row in rows]


def run_benchmarks(program: Path, arguments: Sequence[str], cores: int) -> dict[str, Any]:
    """The JSON of a program that runs on so many processors."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.json"
        allowed = os.sched_getaffinity(0)
        try:
            pin(cores)
            subprocess.run(
                [str(program), *arguments, f"--benchmark_out={out}"],
                check=True,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        finally:
            os.sched_setaffinity(0, allowed)
        text = out.read_text(encoding="utf-8")
    # The file stays empty where the filter names no benchmark.
    content: dict[str, Any] = json.loads(text) if text else {"context": {}, "benchmarks": []}
    return content


def benchmark_time(run: Mapping[str, Any]) -> float:
    """Nanoseconds: processor time, or what the benchmark itself took as its time."""
    own = run["run_name"].endswith(("manual_time", "real_time"))
    value = run["real_time" if own else "cpu_time"]
    return float(value) * NANOSECONDS[run["time_unit"]]


def grouped(runs: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """The single runs of every benchmark, aggregates left out."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for run in runs:
        if run["run_type"] == "iteration":
            groups.setdefault(run["run_name"], []).append(run)
    return groups


def benchmark_rows(runs: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Medians over the repetitions: nanoseconds, rates, what bounds it. In the order of names."""
    rows = []
    for name, repetitions in sorted(grouped(runs).items(), key=_name_order):
        times = summary([benchmark_time(run) for run in repetitions])
        row: dict[str, Any] = {
            "name": name.removesuffix("/manual_time"),
            "ns": times["median"],
            "spread": (times["q3"] - times["q1"]) / times["median"],
            "bound": repetitions[0].get("label", ""),
        }
        for rate in RATES:
            row[rate] = summary([float(run[rate]) for run in repetitions])["median"]
        rows.append(row)
    return rows


def _name_order(item: tuple[str, Any]) -> tuple[Any, ...]:
    """By kernel, then by its arguments as numbers."""
    kernel, *arguments = item[0].split("/")
    numbers = [int(a) if a.isdigit() else 0 for a in arguments]
    return (kernel.startswith("encode"), kernel, *numbers)
