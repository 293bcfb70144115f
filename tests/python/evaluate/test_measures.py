"""The figures of a row."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from vnreg_train.evaluate.failure_kinds import KINDS, MEANINGS, by_category, failure_kinds
from vnreg_train.evaluate.measures import (
    OVERLAP_EDGES,
    binned_recall,
    confidence,
    failures,
    measure,
    nees,
    share,
    wilson_interval,
    wilson_lengths,
)
from vnreg_train.evaluate.scores import Scores


def scores(rotation: list[float], **columns: object) -> Scores:
    """Translation 0 where there is a pose (rotation below 180)."""
    degrees = np.array(rotation)
    count = len(degrees)
    translation = np.where(degrees < 180, 0.0, np.inf)
    fields: dict[str, object] = {
        "rotation_deg": degrees,
        "translation": translation,
        "symmetric_rotation_deg": degrees,
        "symmetric_translation": translation,
        "overlap": np.ones(count),
        "angle_deg": np.zeros(count),
        "same_crop": np.full(count, -1),
        "symmetric_shape": np.zeros(count, bool),
        "ms": np.arange(count) + 1.0,
        "confidence": np.full(count, np.nan),
        "ambiguous": np.zeros(count, bool),
        "right_alternative": np.zeros(count, bool),
        "nees": np.full(count, np.nan),
        "twin": np.zeros(count, bool),
        "against": np.full(count, np.nan),
    }
    return Scores(**{**fields, **{k: np.array(v) for k, v in columns.items()}})


@given(st.integers(1, 3000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_interval_is_wilsons(hits_of: tuple[int, int]) -> None:
    hits, trials = hits_of
    expected = binomtest(hits, trials).proportion_ci(0.95, method="wilson")
    low, high = wilson_interval(hits, trials)
    assert low == pytest.approx(expected.low, abs=1e-6)
    assert high == pytest.approx(expected.high, abs=1e-6)
    assert low < high


@pytest.mark.parametrize(("hits", "trials"), [(1, 0), (-1, 5), (6, 5), (0, 0)])
def test_impossible_counts_have_no_interval(hits: int, trials: int) -> None:
    with pytest.raises(ValueError, match=f"got {hits} of {trials}"):
        wilson_interval(hits, trials)


def test_a_row_of_known_errors() -> None:
    found = measure(scores([0.5, 1, 3, 4, 31, 180]))
    assert found["pairs"] == 6
    assert [s["hits"] for s in found["plain"].values()] == [4, 4, 2]
    assert found["plain"]["5 deg, 0.2"] == share(np.array([1, 1, 1, 1, 0, 0], bool))
    assert found["rotation_deg"] == {"median": 4, "p95": 180}
    assert found["translation"] == {"median": 0, "p95": None}  # one pair has no pose
    assert found["gross"]["hits"] == 2
    assert found["ms"] == {"median": 4, "p95": 6}
    assert found["halves"] is found["confidence"] is found["nees"] is None


def test_the_halves_of_partial_are_counted_apart() -> None:
    halves = measure(scores([1, 9, 1, 9, 9], same_crop=[1, 1, 0, 0, 0]))["halves"]
    assert (halves["same"]["hits"], halves["same"]["pairs"]) == (1, 2)
    assert (halves["opposite"]["hits"], halves["opposite"]["pairs"]) == (1, 3)


def test_recall_by_overlap_puts_each_pair_into_its_bin() -> None:
    found = scores([1, 9, 1, 1, 9], overlap=[0.0, 0.19, 0.2, 1.0, 0.99])
    bins = binned_recall(found, found.overlap, OVERLAP_EDGES)
    assert [(b["from"], b["to"], b["hits"], b["pairs"]) for b in bins] == [
        (0.0, 0.2, 1, 2),
        (0.2, 0.4, 1, 1),
        (0.8, 1.0, 1, 2),
    ]


def test_the_bars_of_a_plot_end_where_the_intervals_do() -> None:
    counts = [(0, 7), (5, 9), (12, 12)]
    below, above = wilson_lengths(counts)
    for (hits, trials), down, up in zip(counts, below, above, strict=True):
        expected = wilson_interval(hits, trials)
        assert (hits / trials - down, hits / trials + up) == pytest.approx(expected)


def test_kinds_of_failure_by_what_the_pose_looks_like() -> None:
    found = scores(
        [1, 180, 12, 90, 170, 170, 90, 90],
        twin=[0, 0, 1, 1, 1, 0, 0, 0],
        overlap=[0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.9],
        confidence=[0.9, np.nan, 0.9, 0.2, 0.9, 0.1, 0.1, 0.6],
    )
    kinds = [KINDS[k] for k in failure_kinds(found)]
    assert kinds[:4] == ["right", "no pose", "near miss", "twin"]
    assert kinds[4:] == ["twin", "flipped", "little overlap", "other"]
    table = by_category(found, ["lamp", "lamp", "lamp", "sofa", "sofa", "sofa", "sofa", "sofa"])
    assert list(table) == ["lamp", "sofa"]
    assert table["lamp"]["pairs"] == 3 and table["sofa"]["twin"] == 2
    assert (table["lamp"]["sure"], table["sofa"]["sure"]) == (1, 2)
    for counts in table.values():
        assert sum(counts[kind] for kind in KINDS) == counts["pairs"]
    assert set(MEANINGS) == set(KINDS[1:])


def test_each_failure_counts_once_where_it_fits_first() -> None:
    found = failures(
        scores(
            [1, 180, 12, 90, 90, 90, 90],
            ambiguous=[1, 1, 1, 1, 0, 1, 0],
            right_alternative=[1, 0, 1, 1, 1, 0, 0],
            twin=np.array([0, 0, 0, 1, 0, 0, 1], bool),
            against=[np.nan, np.nan, 2.9, -4.0, 3.1, 900.0, 0.0],
        )
    )
    twins, untold = found.pop("twins"), found.pop("untold")
    assert found == {"no_pose": 1, "near": 1, "alternative": 2, "ambiguous": 1, "wrong": 1}
    assert (twins, untold) == (2, 3)


def test_confidence_of_a_row_leaves_out_pairs_without_one() -> None:
    found = confidence(scores([1, 2, 50, 180], confidence=[0.9, 0.8, 0.1, np.nan]))
    assert found is not None
    assert found["pairs"] == 3 and found["auroc"] == 1
    assert found["ece"] == pytest.approx((0.1 + 0.2 + 0.1) / 3)
    assert found["bins"]["pairs"] == [1, 1, 1]
    every = confidence(scores([1, 2], confidence=[0.9, 0.8]))
    assert every is not None and every["auroc"] is None  # no failure to tell from


def test_the_mean_squared_error_is_of_those_that_have_one() -> None:
    assert nees(scores([1, 1, 50], nees=[4.0, 9.0, np.nan])) == {
        "pairs": 2,
        "mean": 6.5,
        "median": 6.5,
    }
