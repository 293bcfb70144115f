"""python -m vnreg_bench run [--quick] | report | compare BASE"""

from __future__ import annotations

import argparse
import json
import logging
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

from vnreg_bench.machine import WAIT_POLICY, commit, describe, take_priority
from vnreg_bench.settings import ROOT, Settings

JSON = ROOT / "docs" / "benchmark" / "benchmark.json"


def parts() -> dict[str, Callable[[Settings], dict[str, Any]]]:
    """What a run consists of; imported only where it runs."""
    from vnreg_bench import batch, contest, engine_times, footprint, kernels, low_precision, peers

    return {
        "kernels": kernels.kernels,
        "points": engine_times.time_against_points,
        "channels": engine_times.time_against_channels,
        "threads": engine_times.time_against_threads,
        "latency": engine_times.latency,
        "footprint": footprint.footprint,
        "contest": contest.contest,
        "peers": peers.peers,
        "low_precision": low_precision.low_precision,
        "batch": batch.batch,
    }


def settings_of(arguments: argparse.Namespace) -> Settings:
    if arguments.quick:
        return Settings.quick(arguments.build, arguments.data)
    return Settings(build=arguments.build, data=arguments.data)


def run(arguments: argparse.Namespace) -> None:
    """Every part in a process of its own, so that none inherits another's threads and caches.

    With --parts, what the JSON says of the others stays.
    """
    if arguments.real_time:
        take_priority()
    report: dict[str, Any] = {"measured": {}}
    if arguments.parts and arguments.json.exists():
        report = json.loads(arguments.json.read_text(encoding="utf-8"))
    report["machine"] = describe()
    arguments.json.parent.mkdir(parents=True, exist_ok=True)
    for name in arguments.parts or parts():
        print(f"{datetime.now():%H:%M:%S}  {name}", flush=True)
        report["measured"][name], report[name] = measured_part(name, arguments)
        arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    write_report(arguments)


def measured_part(
    name: str, arguments: argparse.Namespace
) -> tuple[dict[str, Any], dict[str, Any]]:
    """How a part was measured, and what it found."""
    started, load = time.monotonic(), os.getloadavg()[0]
    command = [sys.executable, "-m", "vnreg_bench", "part", name]
    command += ["--build", str(arguments.build), "--data", str(arguments.data)]
    command += ["--quick"] if arguments.quick else []
    environment = os.environ | {"PYTHONWARNINGS": "ignore::FutureWarning"}  # of torch, about torch
    if name != "threads":  # which times the engine as it comes
        environment[WAIT_POLICY] = "passive"  # runtimes share the processors: none may spin
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "part.json"
        subprocess.run([*command, "--out", str(out)], check=True, env=environment)
        found: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    about = {
        "date": f"{datetime.now():%Y-%m-%d %H:%M}",
        "commit": commit(),
        "minutes": (time.monotonic() - started) / 60,
        "load": [load, os.getloadavg()[0]],
        "real_time": arguments.real_time,
        "settings": settings_of(arguments).to_json(),
    }
    return about, found


def run_part(arguments: argparse.Namespace) -> None:
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    found = parts()[arguments.name](settings_of(arguments))
    arguments.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def write_report(arguments: argparse.Namespace) -> None:
    """The page and its pictures, beside the JSON."""
    from vnreg_bench.plots import draw_plots
    from vnreg_bench.report import markdown

    report = json.loads(arguments.json.read_text(encoding="utf-8"))
    folder: Path = arguments.json.parent
    page = folder.parent / "benchmark.md"
    page.write_text(markdown(report, draw_plots(report, folder), folder.name), encoding="utf-8")
    print(page)


def compare(arguments: argparse.Namespace) -> None:
    from vnreg_bench.compare import compare_commits

    chosen = (arguments.base, arguments.other, arguments.rounds, arguments.filter)
    sys.exit(compare_commits(*chosen))


def main() -> None:
    root = argparse.ArgumentParser(prog="vnreg_bench", description=__doc__)
    commands = root.add_subparsers(required=True, metavar="COMMAND")

    everything = commands.add_parser("run", help="measure, then write docs/benchmark.md")
    one = commands.add_parser("part", help="measure one part")
    for command in (everything, one):
        command.add_argument("--quick", action="store_true", help="a few minutes, fewer runs")
        command.add_argument("--build", type=Path, default=Settings.build)
        command.add_argument("--data", type=Path, default=Settings.data)
    everything.add_argument("--parts", nargs="+", choices=list(parts()), help="only these")
    everything.add_argument(
        "--real-time", action="store_true", help="come before all other programs (root)"
    )
    everything.add_argument("--json", type=Path, default=JSON)
    everything.set_defaults(do=run)
    one.add_argument("name", choices=list(parts()))
    one.add_argument("--out", type=Path, required=True)
    one.set_defaults(do=run_part)

    report = commands.add_parser("report", help="write the page of a JSON once more")
    report.add_argument("--json", type=Path, default=JSON)
    report.set_defaults(do=write_report)

    other = commands.add_parser("compare", help="this tree beside a commit, benchmark by benchmark")
    other.add_argument("base", help="a commit")
    other.add_argument("--with", dest="other", help="a commit, instead of this working tree")
    other.add_argument("--rounds", type=int, default=10)
    other.add_argument("--filter", default=".", help="of Google Benchmark")
    other.set_defaults(do=compare)

    arguments = root.parse_args()
    arguments.do(arguments)


if __name__ == "__main__":
    main()
