"""Fits the model's confidence: the probability that a pose is right, from how well it fits.

confidence = sigmoid(bias + overlap_weight · overlap + residual_weight · rmse / inlier_distance)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vnreg_train.data.protocol import ANGLES_DEG
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.evaluate.outcomes import Evaluator, Outcomes, concatenated
from vnreg_train.evaluate.recall import PAPER_SETTINGS
from vnreg_train.model_file import read_model, write_model

RIDGE = 1e-3  # of the standardised weights: bounds them where the classes separate
Float64 = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Calibration:
    """The three numbers in the model file, and how they do on the pairs they were fitted to."""

    bias: float
    overlap: float
    residual: float
    pairs: int
    success_share: float
    auroc: float
    ece: float  # expected calibration error, ten bins of equal width

    def metadata(self) -> dict[str, float]:
        """Under the keys of docs/design.md."""
        return {
            "calibration.bias": self.bias,
            "calibration.overlap": self.overlap,
            "calibration.residual": self.residual,
        }

    def confidence(self, overlap: Float64, relative_residual: Float64) -> Float64:
        """As the engine computes it; arrays (N,)."""
        return sigmoid(self.bias + self.overlap * overlap + self.residual * relative_residual)


def sigmoid(x: Float64) -> Float64:
    """Without overflow, for any x."""
    return np.exp(-np.logaddexp(0.0, -x))


def fit_logistic(features: Float64, label: Bools, iterations: int = 100) -> Float64:
    """Ridge logistic regression by Newton's method: features (N, F) -> bias and weights (F + 1,).

    Raises ValueError where all labels are equal: no probability can be learnt from them.
    """
    if label.all() or not label.any():
        raise ValueError(f"expected right and wrong poses, got {int(label.sum())} of {label.size}")
    mean, spread = features.mean(0), features.std(0)
    spread = np.where(spread > 0, spread, 1.0)
    x = np.column_stack([np.ones(len(features)), (features - mean) / spread])
    ridge = RIDGE * np.diag([0.0] + [1.0] * features.shape[1])
    weights = np.zeros(x.shape[1])
    for _ in range(iterations):
        p = sigmoid(x @ weights)
        gradient = x.T @ (p - label) / len(x) + ridge @ weights
        curvature = (x * (p * (1 - p))[:, None]).T @ x / len(x) + ridge
        step = np.linalg.solve(curvature + 1e-12 * np.eye(len(weights)), gradient)
        weights = weights - step / max(1.0, float(np.abs(step).max()))
        if np.abs(step).max() < 1e-10:
            break
    slopes = weights[1:] / spread
    return np.concatenate([[weights[0] - slopes @ mean], slopes])


def auroc(confidence: Float64, success: Bools) -> float:
    """Probability that a right pose has the higher confidence than a wrong one; ties count half."""
    positive, negative = confidence[success], np.sort(confidence[~success])
    if not positive.size or not negative.size:
        raise ValueError("expected right and wrong poses")
    below = np.searchsorted(negative, positive, side="left")
    not_above = np.searchsorted(negative, positive, side="right")
    return float((below + not_above).sum() / (2 * positive.size * negative.size))


def expected_calibration_error(confidence: Float64, success: Bools, bins: int = 10) -> float:
    """Mean over pairs of |mean confidence - share of right poses| of their bin (equal widths)."""
    index = np.minimum((confidence * bins).astype(int), bins - 1)
    error = 0.0
    for bin_index in range(bins):
        inside = index == bin_index
        if inside.any():
            error += inside.mean() * abs(confidence[inside].mean() - success[inside].mean())
    return float(error)


def fit_calibration(outcomes: Outcomes) -> Calibration:
    """From outcomes of all kinds of pairs. Raises ValueError where all or none succeeded."""
    features = np.column_stack([outcomes.overlap, outcomes.relative_residual])
    success = outcomes.success
    bias, overlap, residual = fit_logistic(features, success)
    p = sigmoid(bias + features @ np.array([overlap, residual]))
    return Calibration(
        bias=float(bias),
        overlap=float(overlap),
        residual=float(residual),
        pairs=len(outcomes),
        success_share=float(success.mean()),
        auroc=auroc(p, success),
        ece=expected_calibration_error(p, success),
    )


def calibrate_model(
    path: Path,
    shapes: ShapeSet,
    settings: Sequence[str] = PAPER_SETTINGS,
    angles_deg: Sequence[float] = ANGLES_DEG,
    seed: int = 1,
    threads: int = 2,
    limit: int | None = None,
) -> Calibration:
    """Fits on the given shapes (the validation split) over all settings and ranges."""
    evaluator = Evaluator.load(path, threads=threads)
    indices = range(len(shapes))[:limit]
    outcomes = [
        evaluator.run(shapes, setting, angle, "P0", seed, indices)
        for setting in settings
        for angle in angles_deg
    ]
    return fit_calibration(concatenated(outcomes))


def write_calibrated(source: Path, destination: Path, calibration: Calibration) -> None:
    """The same model with this calibration in its metadata, at another path or in place."""
    metadata, tensors = read_model(source)
    write_model(destination, metadata | calibration.metadata(), tensors)
