"""Turns, medians, tails and histograms."""

from __future__ import annotations

import numpy as np
import pytest
from vnreg_bench.timing import TAIL, WARM_UP, histogram, interleaved, summary, tail


def test_every_round_calls_each_once_and_the_first_rounds_do_not_count() -> None:
    calls: list[str] = []

    def worker(name: str) -> float:
        calls.append(name)
        return float(len(calls))

    times = interleaved({"a": lambda: worker("a"), "b": lambda: worker("b")}, rounds=4)
    assert calls == ["a", "b"] * (WARM_UP + 4)
    first = 2 * WARM_UP + 1
    assert times == {
        "a": [first, first + 2, first + 4, first + 6],
        "b": [first + 1, first + 3, first + 5, first + 7],
    }


def test_summary_is_robust_to_one_interruption() -> None:
    found = summary([3.0, 1.0, 2.0, 2.0, 900.0])
    assert found == {"median": 2.0, "q1": 2.0, "q3": 3.0, "min": 1.0, "runs": 5}


@pytest.mark.parametrize("count", [1, 2, 500, 1000, 10_000])
def test_a_tail_quantile_is_a_time_that_so_many_calls_do_not_exceed(count: int) -> None:
    times = np.random.default_rng(count).permutation(np.arange(1.0, count + 1)).tolist()
    found = tail(times)
    assert found["runs"] == count
    for name, share in TAIL.items():
        assert found[name] in times
        assert sum(t <= found[name] for t in times) >= share * count
        assert sum(t < found[name] for t in times) < share * count


@pytest.mark.parametrize("times", [[2.0], [2.0, 2.0], [1.0, 3.0, 1000.0], [0.1, 0.1000001, 5.0]])
def test_a_histogram_counts_every_call(times: list[float]) -> None:
    found = histogram(times)
    assert sum(found["counts"]) == len(times)
    assert len(found["edges"]) == len(found["counts"]) + 1
    assert all(a < b for a, b in zip(found["edges"], found["edges"][1:], strict=False))
