"""Fits a model's confidence on validation pairs: the probability that a mode's pose is right.

confidence = sigmoid(bias + sum over the mode's evidence of weight · value); right means within 5
degrees and 0.2, in mode verified up to the shape's symmetry. Each mode has its keys in the model
file (docs/design.md), and is fitted on the pairs that it is for. Mode verified also gets the factor
on its covariance that makes the normalised estimation error squared of right poses 6 in the mean.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import vnreg
from vnreg_train.data.mesh import Float64
from vnreg_train.data.shapes import load_shapes
from vnreg_train.evaluate.confidence import Bools, auroc, fit_logistic, reliability, sigmoid
from vnreg_train.evaluate.disjoint import disjoint_answers
from vnreg_train.evaluate.estimates import Estimate
from vnreg_train.evaluate.measures import NEES_DIMENSIONS
from vnreg_train.evaluate.methods import EngineMethod, Method, Mode
from vnreg_train.evaluate.rows import Row, select_rows
from vnreg_train.evaluate.run import Pairing, answers
from vnreg_train.evaluate.scores import score
from vnreg_train.evaluate.symmetry import SymmetryGroup
from vnreg_train.model_file import read_model, write_model

RIDGE = {"paper": 1e-3, "verified": 1e-3}
PREFIX = {"paper": "calibration.", "verified": "calibration.verified."}
# Other pairs than those of `vnreg-train disjoint`.
DISJOINT_SEED = 1_000_000
# Verified: every row of P1 and of views, and P0 as much as the users of its protocol deserve.
ROWS = {"paper": ("p0",), "verified": ("p1", "views", "P0/*/180")}


@dataclass(frozen=True)
class Calibration:
    """The fitted numbers, and how they do on the pairs they were fitted to and on others."""

    mode: str
    bias: float
    weights: dict[str, float]  # by name of the evidence
    pairs: int
    right_share: float
    auroc: float
    ece: float
    held_out_auroc: float  # each half of the shapes judged by a fit on the other half
    held_out_ece: float
    covariance: float | None = None  # mode verified: the factor, where there are covariances

    def metadata(self) -> dict[str, float]:
        """Under the keys of docs/design.md."""
        values = {"bias": self.bias, **self.weights}
        if self.covariance is not None:
            values["covariance"] = self.covariance
        return {PREFIX[self.mode] + name: value for name, value in values.items()}

    def confidence(self, evidence: Mapping[str, float]) -> float:
        """As the engine computes it."""
        total = self.bias + sum(weight * evidence[name] for name, weight in self.weights.items())
        return float(sigmoid(np.array(total)))


@dataclass(frozen=True)
class Sample:
    """Of N poses: evidence (N, F), whether they are right (N,), of which shape (N,).

    nees: (N,) normalised estimation error squared, NaN of poses without one.
    """

    names: tuple[str, ...]
    evidence: Float64
    right: Bools
    shape: Float64
    nees: Float64


def fit_calibration(sample: Sample, mode: str, factor: float = 1.0) -> Calibration:
    """factor: that the covariances behind the sample were made with.

    Raises ValueError where all or no poses are right.
    """
    weights = fit_logistic(sample.evidence, sample.right, RIDGE[mode])
    fitted = _probability(sample.evidence, weights)
    others = np.empty(len(fitted))
    for half in (0, 1):
        inside = sample.shape % 2 == half
        other = fit_logistic(sample.evidence[~inside], sample.right[~inside], RIDGE[mode])
        others[inside] = _probability(sample.evidence[inside], other)
    known = sample.nees[np.isfinite(sample.nees)]
    return Calibration(
        mode=mode,
        bias=float(weights[0]),
        weights={n: float(w) for n, w in zip(sample.names, weights[1:], strict=True)},
        pairs=len(fitted),
        right_share=float(sample.right.mean()),
        auroc=auroc(fitted, sample.right),
        ece=reliability(fitted, sample.right).error,
        held_out_auroc=auroc(others, sample.right),
        held_out_ece=reliability(others, sample.right).error,
        covariance=factor * float(known.mean()) / NEES_DIMENSIONS if known.size else None,
    )


def _probability(evidence: Float64, weights: Float64) -> Float64:
    return sigmoid(weights[0] + evidence @ weights[1:])


def collect_sample(
    method: Method,
    mode: str,
    pairing: Pairing,
    seeds: Sequence[int],
    groups: Mapping[str, SymmetryGroup],
) -> Sample:
    """The method's evidence on all the mode's rows, for several seeds of the pairs."""
    names: tuple[str, ...] = ()
    evidence, right, shape, nees = [], [], [], []
    for row, seed in _draws(mode, seeds):
        drawn = replace(pairing, seed=seed)
        pairs, estimates = list(drawn.pairs(row)), answers(method, row, drawn)
        scores = score(pairs, estimates, groups)
        correct = scores.symmetric() if mode == "verified" else scores.plain()
        for k, (pair, estimate) in enumerate(zip(pairs, estimates, strict=True)):
            if estimate.T_target_source is not None:
                names = names or _evidence_names(estimate, mode)
                evidence.append([estimate.evidence[name] for name in names])
                right.append(correct[k])
                # Clouds that share points, as those of P0, fit better than their noise says.
                nees.append(scores.nees[k] if row.protocol == "P1" else np.nan)
                shape.append(float(pair.shape))
    return Sample(names, np.array(evidence), np.array(right, bool), np.array(shape), np.array(nees))


def with_different_objects(sample: Sample, path: Path, pairing: Pairing, count: int) -> Sample:
    """The sample, and the evidence of `count` pairs of two different shapes: all of them wrong."""
    registrar = vnreg.Registrar(vnreg.Model.load(path), threads=1)
    shapes = load_shapes(pairing.data, pairing.split, queries=0)
    answers = disjoint_answers(registrar, shapes, count, seed=DISJOINT_SEED)
    posed = [answer for answer in answers if answer.result.has_pose]
    evidence = [[answer.result.evidence[name] for name in sample.names] for answer in posed]
    return Sample(
        sample.names,
        np.concatenate([sample.evidence, np.array(evidence)]),
        np.concatenate([sample.right, np.zeros(len(posed), bool)]),
        np.concatenate([sample.shape, [float(answer.source_shape) for answer in posed]]),
        np.concatenate([sample.nees, np.full(len(posed), np.nan)]),
    )


def _draws(mode: str, seeds: Sequence[int]) -> Iterator[tuple[Row, int]]:
    for row in select_rows(ROWS[mode]):
        for seed in seeds:
            yield row, seed


def _evidence_names(estimate: Estimate, mode: str) -> tuple[str, ...]:
    if not estimate.evidence:
        raise ValueError(f"the engine gives no evidence in mode {mode}: there is nothing to fit")
    return tuple(estimate.evidence)


def calibrate_model(
    path: Path,
    mode: Mode,
    pairing: Pairing,
    seeds: Sequence[int],
    groups: Mapping[str, SymmetryGroup],
    different: int = 0,
) -> Calibration:
    """Fits one mode of a model file on the pairing's split.

    different: so many pairs of different objects are wrong poses, too; mode verified only.
    """
    sample = collect_sample(EngineMethod(mode, path), mode, pairing, seeds, groups)
    if different > 0:
        sample = with_different_objects(sample, path, pairing, different)
    factor = float(read_model(path)[0].get(PREFIX["verified"] + "covariance", 1.0))
    return fit_calibration(sample, mode, factor)


def write_calibrated(source: Path, destination: Path, calibration: Calibration) -> None:
    """The same model with this calibration in place of the mode's old one.

    At another path or in place. The other mode's numbers stay.
    """
    metadata, tensors = read_model(source)
    old = [key for key in metadata if _belongs(key, calibration.mode)]
    kept = {key: value for key, value in metadata.items() if key not in old}
    write_model(destination, kept | calibration.metadata(), tensors)


def _belongs(key: str, mode: str) -> bool:
    verified = key.startswith(PREFIX["verified"])
    return verified if mode == "verified" else key.startswith(PREFIX["paper"]) and not verified
