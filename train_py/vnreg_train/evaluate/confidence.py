"""Probabilities that a pose is right: how good they are, and how they are fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vnreg_train.data.mesh import Float64

Bools = NDArray[np.bool_]
BINS = 10


def auroc(confidence: Float64, right: Bools) -> float:
    """Probability that a right pose has the higher confidence than a wrong one; ties count half.

    Arrays (N,). NaN where all poses are right, or all wrong.
    """
    positive, negative = confidence[right], np.sort(confidence[~right])
    if not positive.size or not negative.size:
        return float("nan")
    below = np.searchsorted(negative, positive, side="left")
    not_above = np.searchsorted(negative, positive, side="right")
    return float((below + not_above).sum() / (2 * positive.size * negative.size))


@dataclass(frozen=True)
class Reliability:
    """Bins of equal width of the confidence, empty ones left out; arrays (B,)."""

    confidence: Float64  # mean
    right: Float64  # share
    pairs: NDArray[np.int64]

    @property
    def error(self) -> float:
        """The expected calibration error: mean over pairs of |confidence - right| of their bin."""
        gaps = np.abs(self.confidence - self.right)
        return float((gaps * self.pairs).sum() / self.pairs.sum())


def reliability(confidence: Float64, right: Bools, bins: int = BINS) -> Reliability:
    """Of N >= 1 pairs: confidences 0 to 1 and whether the poses are right, arrays (N,)."""
    index = np.minimum((confidence * bins).astype(int), bins - 1)
    pairs = np.bincount(index, minlength=bins)
    used = pairs > 0
    sums = [np.bincount(index, weights=w, minlength=bins)[used] for w in (confidence, right)]
    return Reliability(sums[0] / pairs[used], sums[1] / pairs[used], pairs[used])


def sigmoid(x: Float64) -> Float64:
    """Without overflow, for any x."""
    return np.exp(-np.logaddexp(0.0, -x))


def fit_logistic(features: Float64, label: Bools, ridge: float, iterations: int = 100) -> Float64:
    """Ridge logistic regression by Newton's method: features (N, F) -> bias and weights (F + 1,).

    The ridge is on the weights of the standardised features, per pair. Raises ValueError where
    all labels are equal: no probability can be learnt from them.
    """
    if label.all() or not label.any():
        raise ValueError(f"expected right and wrong poses, got {int(label.sum())} of {label.size}")
    mean, spread = features.mean(0), features.std(0)
    spread = np.where(spread > 0, spread, 1.0)
    x = np.column_stack([np.ones(len(features)), (features - mean) / spread])
    penalty = ridge * np.diag([0.0] + [1.0] * features.shape[1])
    weights = np.zeros(x.shape[1])
    for _ in range(iterations):
        p = sigmoid(x @ weights)
        gradient = x.T @ (p - label) / len(x) + penalty @ weights
        curvature = (x * (p * (1 - p))[:, None]).T @ x / len(x) + penalty
        step = np.linalg.solve(curvature + 1e-12 * np.eye(len(weights)), gradient)
        weights = weights - step / max(1.0, float(np.abs(step).max()))
        if np.abs(step).max() < 1e-10:
            break
    slopes = weights[1:] / spread
    return np.concatenate([[weights[0] - slopes @ mean], slopes])
