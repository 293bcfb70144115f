"""This working tree (or a commit) beside a commit: both are built, their benchmarks run in turns.

The ratio of a benchmark is the median over rounds of its time here over its time there. Noise is
the standard error of that median, from the rounds' own spread. A benchmark is slower where its
ratio exceeds 1 + THRESHOLD by more than NOISE_FACTOR standard errors: so noise alone does not raise
an alarm, and a slowdown within the threshold is not one.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vnreg_bench.kernels import benchmark_time, grouped, run_benchmarks
from vnreg_bench.machine import cpu_field
from vnreg_bench.settings import ROOT
from vnreg_train.evaluate.report import table

# Where the compiler happens to place a loop moves kernels below a microsecond by up to 8 %, between
# commits that do not touch them.
THRESHOLD = 0.1
NOISE_FACTOR = 2.0
PROGRAMS = ("kernels_bench", "align_bench")
BUILD = ROOT / "build" / "compare"
Rounds = dict[str, list[float]]  # nanoseconds of every round, by benchmark


def compare_commits(base: str, other: str | None, rounds: int, chosen: str) -> int:
    """Prints the table, writes build/compare/compare.json; 1 where a benchmark became slower.

    base: a commit. other: a commit, or None for the working tree.
    """
    builds = [build_commit(base, BUILD / "base")]
    if other is None:
        builds.append(build_tree(ROOT, BUILD / "other"))
    else:
        builds.append(build_commit(other, BUILD / "other"))
    times = run_rounds(builds[0], builds[1], rounds, chosen)
    rows = compare_rounds(*times)
    alone = sorted(set(times[0]) ^ set(times[1]))
    name = other or "this tree"
    built = ", ".join(build_words(build) for build in builds)
    print(f"{cpu_field('model name')}; {built}")
    print(f"{name} / {base}, {rounds} rounds in turns\n")
    print(comparison_table(rows))
    if alone:
        print(f"\nOnly in one of both: {', '.join(alone)}")
    slower = [row["name"] for row in rows if row["slower"]]
    report = {"base": base, "other": name, "rounds": rounds, "rows": rows, "only_in_one": alone}
    (BUILD / "compare.json").write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    print(f"\n{len(slower)} of {len(rows)} slower by more than {100 * THRESHOLD:.0f} %")
    return 1 if slower else 0


def build_commit(commit: str, build: Path) -> Path:
    """As build_tree, of a commit, which is checked out for as long as that takes: always at the
    same place, so that ccache knows its files again."""
    tree = build.with_name(f"{build.name}-tree")
    if tree.exists():  # of a run that was killed
        _git("worktree", "remove", "--force", str(tree))
    _git("worktree", "add", "--quiet", "--detach", str(tree), commit)
    try:
        return build_tree(tree, build)
    finally:
        _git("worktree", "remove", "--force", str(tree))


def _git(*arguments: str) -> None:
    subprocess.run(["git", "-C", str(ROOT), *arguments], check=True, stdout=subprocess.DEVNULL)


def build_tree(tree: Path, build: Path) -> Path:
    """Its benchmarks, in a folder that is kept; returns that folder."""
    shutil.rmtree(build, ignore_errors=True)
    launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
    options = ["-DCMAKE_BUILD_TYPE=Release", "-DVNREG_BUILD_BENCH=ON"]
    options += ["-DVNREG_BUILD_TESTS=OFF", "-DVNREG_BUILD_CLI=OFF"]
    configure = ["cmake", "-S", str(tree), "-B", str(build), "-G", "Ninja", *options, *launcher]
    # Paths from the tree's own root, so that equal sources come from ccache.
    environment = os.environ | {"CCACHE_BASEDIR": str(tree)}
    subprocess.run(configure, check=True, stdout=subprocess.DEVNULL, env=environment)
    compile_all = ["cmake", "--build", str(build), "--target", *PROGRAMS]
    subprocess.run(compile_all, check=True, stdout=subprocess.DEVNULL, env=environment)
    return build


def build_words(build: Path) -> str:
    """Instruction set and compiler of a build, as its cache says."""
    cache = (build / "CMakeCache.txt").read_text(encoding="utf-8").splitlines()
    values = dict(line.split("=", 1) for line in cache if "=" in line)
    found = {name.split(":")[0]: value for name, value in values.items()}
    isa, compiler = found.get("VNREG_ISA", "?"), found["CMAKE_CXX_COMPILER"]
    number = subprocess.run([compiler, "-dumpfullversion"], capture_output=True, text=True)
    return f"{build.name}: {isa}, {Path(compiler).name} {number.stdout.strip()}"


def run_rounds(base: Path, other: Path, rounds: int, chosen: str) -> tuple[Rounds, Rounds]:
    """Times of every benchmark: in each round each program runs once, which first taking turns."""
    found: tuple[Rounds, Rounds] = ({}, {})
    options = ["--benchmark_min_time=0.02", f"--benchmark_filter={chosen}"]
    for number in range(rounds):
        order = ((base, found[0]), (other, found[1]))
        for program in PROGRAMS:
            for build, times in order if number % 2 == 0 else reversed(order):
                _append(times, run_benchmarks(build / program, options, cores=2)["benchmarks"])
    return found


def _append(times: Rounds, runs: Sequence[Mapping[str, Any]]) -> None:
    for name, repetitions in grouped(runs).items():
        median = float(np.median([benchmark_time(run) for run in repetitions]))
        times.setdefault(name, []).append(median)


def compare_rounds(base: Rounds, other: Rounds) -> list[dict[str, Any]]:
    """One row for each benchmark of both, the slowest ratio first."""
    rows = [
        {"name": name, **compare_times(base[name], other[name])} for name in base if name in other
    ]
    return sorted(rows, key=lambda row: -row["ratio"])


def compare_times(base: Sequence[float], other: Sequence[float]) -> dict[str, Any]:
    """Ratio with its standard error, from the times of the same rounds (nanoseconds)."""
    ratios = np.asarray(other) / np.asarray(base)
    ratio = float(np.median(ratios))
    # 1.4826 mad is the standard deviation of a normal distribution, 1.2533 / sqrt(n) of that the
    # standard error of its median.
    deviation = 1.4826 * float(np.median(np.abs(ratios - ratio)))
    noise = 1.2533 * deviation / math.sqrt(len(ratios))
    return {
        "base_ns": float(np.median(base)),
        "other_ns": float(np.median(other)),
        "ratio": ratio,
        "noise": noise,
        "slower": ratio - NOISE_FACTOR * noise > 1 + THRESHOLD,
        "faster": ratio + NOISE_FACTOR * noise < 1 - THRESHOLD,
    }


def comparison_table(rows: Sequence[Mapping[str, Any]]) -> str:
    lines = [
        (
            row["name"],
            f"{1e-3 * row['base_ns']:.2f}",
            f"{1e-3 * row['other_ns']:.2f}",
            f"{row['ratio']:.3f}",
            f"±{row['noise']:.3f}",
            "slower" if row["slower"] else "faster" if row["faster"] else "",
        )
        for row in rows
    ]
    return table(("benchmark", "base, µs", "other, µs", "ratio", "noise", ""), lines)
