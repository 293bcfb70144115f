"""Answers in the files of a run."""

from __future__ import annotations

import json

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vnreg_train.evaluate.estimates import Estimate

numbers = st.floats(-1e100, 1e100)


@given(
    st.lists(numbers, min_size=12, max_size=12),
    st.booleans(),
    st.floats(0, 1) | st.just(float("nan")),
    st.dictionaries(st.text(max_size=5), numbers, max_size=3),
    st.integers(0, 3),
)
def test_answers_survive_the_file_to_the_last_bit(
    rows: list[float], posed: bool, confidence: float, evidence: dict[str, float], others: int
) -> None:
    pose = np.vstack([np.array(rows).reshape(3, 4), [0, 0, 0, 1]])
    before = Estimate(
        pose if posed else None,
        1.25,
        "ok",
        confidence,
        evidence,
        np.outer(rows[:6], rows[6:]) if posed else None,
        (pose,) * others,
    )
    after = Estimate.from_json(json.loads(json.dumps(before.to_json())))
    np.testing.assert_equal(after.T_target_source, before.T_target_source)
    np.testing.assert_equal(after.confidence, before.confidence)
    np.testing.assert_equal(after.covariance, before.covariance)
    np.testing.assert_equal(after.alternatives, before.alternatives)
    assert (after.ms, after.status, after.evidence) == (1.25, "ok", evidence)
