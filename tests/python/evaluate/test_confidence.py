"""Measures of a confidence, and its fit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from vnreg_train.evaluate.confidence import auroc, fit_logistic, reliability, sigmoid

Float64 = NDArray[np.float64]
RIDGE = 1e-3

rows = st.lists(
    st.tuples(st.sampled_from([0.0, 0.1, 0.5, 0.5, 0.9, 1.0]), st.booleans()), min_size=1
)


def columns(table: list[tuple[float, bool]]) -> tuple[Float64, NDArray[np.bool_]]:
    return np.array([row[0] for row in table]), np.array([row[1] for row in table])


@given(rows)
def test_auroc_counts_pairs(table: list[tuple[float, bool]]) -> None:
    confidence, right = columns(table)
    positive, negative = confidence[right], confidence[~right]
    if not positive.size or not negative.size:
        assert math.isnan(auroc(confidence, right))
        return
    wins = [(p > n) + 0.5 * (p == n) for p in positive for n in negative]
    assert auroc(confidence, right) == pytest.approx(np.mean(wins))


@given(rows)
def test_bins_hold_every_pair_once(table: list[tuple[float, bool]]) -> None:
    confidence, right = columns(table)
    diagram = reliability(confidence, right)
    assert diagram.pairs.sum() == len(confidence)
    assert (diagram.confidence * diagram.pairs).sum() == pytest.approx(confidence.sum())
    assert (diagram.right * diagram.pairs).sum() == pytest.approx(right.sum())
    assert 0 <= diagram.error <= 1


def test_calibration_error_of_known_bins() -> None:
    confidence = np.array([0.05, 0.05, 0.95, 0.95, 1.0])
    right = np.array([False, True, True, True, False])
    low = 2 / 5 * abs(0.05 - 0.5)
    high = 3 / 5 * abs((0.95 + 0.95 + 1.0) / 3 - 2 / 3)
    assert reliability(confidence, right).error == pytest.approx(low + high)
    assert reliability(np.array([0.5, 0.5]), np.array([True, False])).error == 0


def drawn(weights: list[float], count: int) -> tuple[Float64, NDArray[np.bool_]]:
    """Features of very different scales, and labels drawn with the logistic probability."""
    rng = np.random.default_rng(0)
    features = rng.uniform(0, 1, (count, 2)) * [1.0, 0.3]
    p = sigmoid(weights[0] + features @ np.array(weights[1:]))
    return features, rng.uniform(size=count) < p


def test_the_weights_behind_the_labels_are_found() -> None:
    truth = [-4.0, 8.0, -6.0]
    features, label = drawn(truth, 40_000)
    np.testing.assert_allclose(fit_logistic(features, label, RIDGE), truth, rtol=0.08)


def test_the_fit_is_where_the_gradient_vanishes() -> None:
    features, label = drawn([-1.0, 3.0, 2.0], 500)
    weights = fit_logistic(features, label, RIDGE)
    residual = sigmoid(weights[0] + features @ weights[1:]) - label
    assert abs(residual.mean()) < 1e-8  # the bias is not penalised
    assert np.abs(residual @ features / 500).max() < 2e-3  # the slopes hardly


def test_a_strong_ridge_leaves_the_share_alone() -> None:
    features, label = drawn([-1.0, 3.0, 2.0], 500)
    weights = fit_logistic(features, label, 1e6)
    np.testing.assert_allclose(weights[1:], 0, atol=1e-4)
    assert sigmoid(weights[0]) == pytest.approx(label.mean(), abs=1e-4)


def test_separable_and_constant_features_stay_finite() -> None:
    features = np.column_stack([np.linspace(0, 1, 50), np.full(50, 0.3)])
    weights = fit_logistic(features, features[:, 0] > 0.5, RIDGE)
    assert np.isfinite(weights).all()
    assert weights[1] > 5
    p = sigmoid(weights[0] + features @ weights[1:])
    np.testing.assert_array_equal(p > 0.5, features[:, 0] > 0.5)


@pytest.mark.parametrize("value", [True, False])
def test_equal_labels_teach_nothing(value: bool) -> None:
    with pytest.raises(ValueError, match="right and wrong poses"):
        fit_logistic(np.zeros((5, 2)), np.full(5, value), RIDGE)


def test_sigmoid_never_overflows() -> None:
    with np.errstate(all="raise", under="ignore"):
        np.testing.assert_allclose(sigmoid(np.array([-1e4, 0.0, 1e4])), [0, 0.5, 1])
