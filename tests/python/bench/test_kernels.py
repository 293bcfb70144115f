"""What is read from Google Benchmark, and the programs themselves where they are built."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from vnreg_bench.kernels import against_roof, benchmark_rows, benchmark_time, kernels
from vnreg_bench.settings import Settings


def repetition(name: str, cpu: float, real: float, unit: str = "us", **more: Any) -> dict[str, Any]:
    rates = {"GFLOP/s": 1.0, "GB/s": 2.0, "share": 0.5}
    return {
        "run_name": name,
        "run_type": "iteration",
        "time_unit": unit,
        "cpu_time": cpu,
        "real_time": real,
        "label": "product",
        **rates,
        **more,
    }


def test_interruptions_are_left_out_of_kernels_and_own_times_are_taken() -> None:
    assert benchmark_time(repetition("relu/8", 2.0, 9.0)) == 2e3
    assert benchmark_time(repetition("encode/8/manual_time", 2.0, 9.0, "ms")) == 9e6
    assert benchmark_time(repetition("align/real_time", 2.0, 9.0, "ns")) == 9.0


def test_rows_are_medians_over_repetitions_in_the_order_of_sizes() -> None:
    runs = [
        *(repetition("b/128", t, 9.0, **{"GFLOP/s": t}) for t in (3.0, 1.0, 2.0)),
        repetition("b/32", 1.0, 9.0),
        repetition("encode_a/8/manual_time", 1.0, 5.0),
        {"run_name": "b/128", "run_type": "aggregate", "time_unit": "us"},
    ]
    rows = benchmark_rows(runs)
    assert [row["name"] for row in rows] == ["b/32", "b/128", "encode_a/8"]
    assert rows[1]["ns"] == 2e3
    assert rows[1]["GFLOP/s"] == 2.0
    assert rows[1]["spread"] == pytest.approx(0.5)


def test_shares_are_of_the_roofline_measured_in_turns() -> None:
    rows = [
        {"name": "a", "bound": "product", "share": 0.5},
        {"name": "b", "bound": "L2", "share": 0.3},
    ]
    roof = [{"bound": "product", "share": 1.25}, {"bound": "L2", "share": 0.6}]
    assert [row["share"] for row in against_roof(rows, roof)] == [0.4, 0.5]


def built() -> Path | None:
    """A folder with the benchmark programs: $VNREG_BENCH_BUILD, or that of `make build`."""
    folder = Path(os.environ.get("VNREG_BENCH_BUILD", Settings.build))
    return folder if (folder / "kernels_bench").exists() else None


@pytest.mark.skipif(built() is None, reason="the benchmarks are not built: make build")
def test_the_paper_network_is_counted_on_its_exact_algebra() -> None:
    """A real run of two benchmarks: counts and time give the rate, the roofline is above zero."""
    build = built()
    assert build is not None
    chosen = "encode_paper/128/256/1|packed_product/128/128"
    found = kernels(Settings(build=build, kernel_repetitions=1, kernel_filter=chosen))
    rows = {row["name"]: row for row in found["rows"]}
    assert set(rows) == {"encode_paper/128/256/1", "packed_product/128/128"}
    encoder, product = rows["encode_paper/128/256/1"], rows["packed_product/128/128"]
    # Of 1,024 points: 7.3 GFLOP of 12.2 as usually written.
    per_pair = 4 * encoder["GFLOP/s"] * encoder["ns"] * 1e-9
    assert 7.2 < per_pair < 7.5
    flops = product["GFLOP/s"] * product["ns"]
    assert flops == pytest.approx(2 * 128 * 128 * 96, rel=0.02)
    assert set(found["roof"]) == {"product", "L1", "L2", "L3", "memory"}
    assert min(found["roof"].values()) > 1
    assert found["compiler"]
