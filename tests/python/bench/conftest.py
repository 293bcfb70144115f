"""The package of bench/, which is not installed, and a run's JSON made up of known figures."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "bench"))


def summary(median: float) -> dict[str, float]:
    return {"median": median, "q1": median, "q3": median, "min": median, "runs": 9}


def kernel_row(name: str, ns: float, share: float) -> dict[str, Any]:
    rates = {"GFLOP/s": 50.0, "GB/s": 2.0, "share": share}
    return {"name": name, "ns": ns, "spread": 0.01, "bound": "product", **rates}


@pytest.fixture
def report() -> dict[str, Any]:
    """Parts kernels, threads, latency and peers of a run: some bars are met, some are missed."""
    parts: dict[str, Any] = {
        "kernels": {
            "compiler": "GNU 12",
            "roof": {"product": 100.0, "L1": 150.0},
            "rows": [
                kernel_row("encode_vnreg/1024/1", 5e6, 0.59),
                kernel_row("encode_paper/128/1024/1", 8e7, 0.9),
                kernel_row("mean_neighbours/1024", 0.25e6, 0.01),
                kernel_row("moments_of_half/1024", 1.2e6, 0.2),
            ],
        },
        "threads": {
            "times": {
                "verified/1": summary(12.0),
                "verified/2": summary(6.0),
                "paper128/1": summary(80.0),
                "paper128/2": summary(50.0),
            },
            "processes": {"alone": [10.0, 12.0], "together": [12.5, 15.0]},
            "waiting": [
                {
                    "busy": busy,
                    "policy": policy,
                    "threads": threads,
                    "tail": {"p50": 6.0, "p95": 7.0, "p99": 8.5, "p99.9": 9.0, "runs": 90},
                }
                for busy in (0, 1)
                for policy in ("default", "passive")
                for threads in (1, 2)
            ],
        },
        "latency": {
            "row": "P1/noise_0.01",
            "points": 1024,
            "series": {
                name: {
                    "pairs": 82,
                    "tail": {"p50": 10.0, "p95": 11.0, "p99": p99, "p99.9": 40.0, "runs": 500},
                    "histogram": {"edges": [9.0, 20.0, 40.0], "counts": [490, 10]},
                }
                for name, p99 in (("one pair", 10.5), ("different pairs", 16.0))
            },
            "medians": {"512": summary(4.0), "1024": summary(10.5)},
        },
        "peers": {
            "split": "validation",
            "shapes": 82,
            "rows": {
                "P1/noise_0.01": {
                    name: {"recall": recall, "interval_95": [0.1, 0.9], "ms": ms, "ms_p95": ms}
                    for name, recall, ms in (
                        ("verified", 0.9, 10.0),
                        ("paper", 0.2, 8.0),
                        ("open3d_ransac_icp", 0.85, 90.0),
                        ("kiss_matcher_icp", 0.3, 35.0),
                        ("small_gicp", 0.1, 12.0),
                    )
                }
            },
        },
    }
    about = {
        "date": "2026-01-02 03:04",
        "commit": "abc1234",
        "minutes": 1.5,
        "load": [0.0, 1.0],
        "real_time": False,
        "settings": {
            "rounds": 9,
            "kernel_repetitions": 3,
            "latency_pairs": 500,
            "peer_shapes": 82,
        },
    }
    machine = {
        "cpu": "A processor",
        "family": "1, model 2",
        "extensions": ["avx2"],
        "cores": 2,
        "caches": {"L1": "32K"},
        "system": "Linux",
        "vnreg": "0.1.0",
        "instruction_set": "x86-64-v3",
        "python": "3.11",
        "packages": {"torch": "2.13.0"},
    }
    return {**parts, "machine": machine, "measured": {name: about for name in parts}}
