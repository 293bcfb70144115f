"""The engine alone: time against points, channels and threads; stages; latency."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import vnreg
from vnreg_bench.inputs import SHIPPED, Cloud, bent_box, random_paper_model
from vnreg_bench.machine import pin
from vnreg_bench.settings import Settings
from vnreg_bench.side_by_side import processes_at_once
from vnreg_bench.timing import (
    WARM_UP,
    Times,
    histogram,
    interleaved,
    milliseconds,
    rest,
    summary,
    tail,
)
from vnreg_bench.waiting import cost_of_waiting
from vnreg_train.evaluate.methods import Mode
from vnreg_train.evaluate.pairs import make_pairs
from vnreg_train.model_file import read_model

PAUSE_S = 0.02  # several times as long as GCC's OpenMP lets threads spin
LATENCY_ROW = "P1/noise_0.01"
MODES: dict[str, tuple[Mode, str]] = {  # of the sweeps: label -> (mode, model)
    "verified": ("verified", "vnreg"),
    "paper": ("paper", "small"),
    "coarse": ("coarse", "vnreg"),
}


def registrar(label: str, points: int, threads: int = 1) -> vnreg.Registrar:
    """For clouds of that many points, none of which is left out."""
    mode, model = MODES[label]
    loaded = vnreg.Model.load(SHIPPED[model])
    return vnreg.Registrar(loaded, mode=mode, threads=threads, max_points=max(64, points))


def aligner(use: vnreg.Registrar, pair: tuple[Cloud, Cloud]) -> Callable[[], float]:
    """Milliseconds of one call, as a caller in Python sees it."""
    return lambda: milliseconds(lambda: use.align(*pair))


def time_against_points(settings: Settings) -> dict[str, Any]:
    """Milliseconds by mode and number of points, one thread, and the stages of each."""
    pin(1)
    work, stages = {}, {}
    for label in MODES:
        for points in settings.sizes:
            use, pair = registrar(label, points), bent_box(points)
            work[f"{label}/{points}"] = aligner(use, pair)
            stages[f"{label}/{points}"] = _median_stages(use, pair, settings.rounds // 3)
    times = interleaved(work, settings.rounds)
    return {
        "modes": {label: list(MODES[label]) for label in MODES},
        "described": read_model(SHIPPED[MODES["verified"][1]])[0]["input.encoded"],
        "times": {key: summary(t) for key, t in times.items()},
        "stages": stages,
    }


def _median_stages(use: vnreg.Registrar, pair: tuple[Cloud, Cloud], runs: int) -> dict[str, float]:
    """Median milliseconds of every stage that the engine tells."""
    use.align(*pair)
    seen = [use.align(*pair).ms for _ in range(max(3, runs))]
    return {stage: summary([ms[stage] for ms in seen])["median"] for stage in seen[0]}


def time_against_channels(settings: Settings) -> dict[str, Any]:
    """The paper's network by its width C, L = C / 2, whole paper mode, 1,024 points, one thread."""
    pin(1)
    pair, work, encode = bent_box(1024), {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for channels in settings.channels:
            path = Path(folder) / f"{channels}.vnr"
            random_paper_model(path, channels)
            use = vnreg.Registrar(vnreg.Model.load(path), mode="paper", threads=1)
            work[str(channels)] = aligner(use, pair)
            encode[str(channels)] = _median_stages(use, pair, settings.rounds // 3)["encode"]
    times = interleaved(work, settings.rounds)
    return {"times": {key: summary(t) for key, t in times.items()}, "encode": encode}


def time_against_threads(settings: Settings) -> dict[str, Any]:
    """Milliseconds by mode and threads, 1,024 points; `paper128` is the paper's own width. And what
    as many processes gain, which share nothing but the machine; and what the ways cost in which
    threads may wait."""
    pin(max(settings.threads))
    pair, work = bent_box(1024), {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "paper.vnr"
        random_paper_model(path, 128)
        wide = vnreg.Model.load(path)
    for threads in settings.threads:
        for label in MODES:
            work[f"{label}/{threads}"] = aligner(registrar(label, 1024, threads), pair)
        paper = vnreg.Registrar(wide, mode="paper", threads=threads)
        work[f"paper128/{threads}"] = aligner(paper, pair)
    times = interleaved(work, settings.rounds, PAUSE_S)
    return {
        "times": {key: summary(t) for key, t in times.items()},
        "processes": processes_at_once(sorted(os.sched_getaffinity(0)), 4 * settings.rounds),
        "waiting": cost_of_waiting(pair, settings.threads, 10 * settings.rounds),
    }


def latency(settings: Settings) -> dict[str, Any]:
    """Mode verified, one thread, pairs of the validation split: different pairs of 1,024 points one
    after the other, and one pair again and again, which leaves what the machine adds; and medians
    over the pairs, also of half the points."""
    pin(1)
    pairs = make_pairs("validation", LATENCY_ROW, data=settings.data)
    clouds = [(pair.source, pair.target) for pair in pairs]
    series, calls = {}, settings.latency_pairs
    for name, of, count in (
        ("different pairs", clouds, calls),
        ("one pair", clouds[:1], calls // 5),
    ):
        times = align_in_turn(of, 1024, count)
        series[name] = {"pairs": len(of), "tail": tail(times), "histogram": histogram(times)}
    medians = {
        str(points): summary(align_in_turn(clouds, points, max(len(clouds), settings.rounds)))
        for points in (512, 1024)
    }
    return {"row": LATENCY_ROW, "points": 1024, "series": series, "medians": medians}


def align_in_turn(clouds: Sequence[tuple[Cloud, Cloud]], points: int, calls: int) -> Times:
    """Milliseconds of mode verified on one pair after the other, from the first again behind the
    last. Clouds with more points are thinned to `points` before."""
    use, thinned = registrar("verified", points), [(s[:points], t[:points]) for s, t in clouds]
    for pair in thinned[:WARM_UP]:
        use.align(*pair)
    times = []
    for i in range(calls):
        times.append(aligner(use, thinned[i % len(thinned)])())
        rest(times[-1])
    return times
