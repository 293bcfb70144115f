"""`make bench-compare`: a slowdown is seen, and noise is not taken for one."""

from __future__ import annotations

import numpy as np
import pytest
from vnreg_bench.compare import (
    NOISE_FACTOR,
    THRESHOLD,
    compare_rounds,
    compare_times,
    comparison_table,
)


def rounds(factor: float, noise: float, seed: int, count: int = 10) -> list[float]:
    rng = np.random.default_rng(seed)
    return (1000 * factor * (1 + noise * rng.standard_normal(count))).tolist()


@pytest.mark.parametrize("factor", [1.0, 0.7, 1.2, 2.0])
def test_a_change_beyond_the_threshold_is_told_apart_from_noise(factor: float) -> None:
    for seed in range(20):
        found = compare_times(rounds(1.0, 0.01, seed), rounds(factor, 0.01, 100 + seed))
        assert found["ratio"] == pytest.approx(factor, rel=0.03)
        assert found["slower"] == (factor > 1.1)
        assert found["faster"] == (factor < 0.9)


def test_the_noise_is_the_standard_error_of_the_median() -> None:
    estimates, ratios = [], []
    for seed in range(400):
        base = [1000.0] * 21
        found = compare_times(base, rounds(1.0, 0.1, seed, count=21))
        estimates.append(found["noise"])
        ratios.append(found["ratio"])
    assert np.mean(estimates) == pytest.approx(np.std(ratios), rel=0.15)


def test_noise_alone_seldom_raises_an_alarm() -> None:
    alarms = sum(
        compare_times(rounds(1.0, 0.1, seed), rounds(1.0, 0.1, 1000 + seed))["slower"]
        for seed in range(200)
    )
    assert alarms < 10


def test_a_change_within_the_threshold_is_no_alarm() -> None:
    found = compare_times([1000.0] * 9, [1000.0 * (1 + 0.9 * THRESHOLD)] * 9)
    assert not found["slower"]
    assert found["noise"] == 0
    assert compare_times([1000.0] * 9, [1000.0 * (1 + 1.1 * THRESHOLD)] * 9)["slower"]
    assert NOISE_FACTOR >= 1


def test_benchmarks_of_one_tree_only_are_not_compared() -> None:
    rows = compare_rounds(
        {"same": [10.0, 10.0], "gone": [1.0, 1.0], "worse": [10.0, 10.0]},
        {"same": [10.0, 10.0], "new": [1.0, 1.0], "worse": [20.0, 20.0]},
    )
    assert [row["name"] for row in rows] == ["worse", "same"]
    text = comparison_table(rows)
    assert "worse | 0.01 | 0.02 | 2.000" in text
    assert "slower" in text.splitlines()[2]
