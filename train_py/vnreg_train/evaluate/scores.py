"""Estimates against the truth: errors per pair, plain and up to the shape's symmetry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vnreg_train.data.mesh import Float64, Int64
from vnreg_train.data.protocol import Pair, rotation_error_deg, translation_error
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.evaluate.estimates import Estimate
from vnreg_train.evaluate.surface_evidence import Surface, evidence
from vnreg_train.evaluate.symmetry import TRIVIAL, SymmetryGroup
from vnreg_train.evaluate.twins import is_twin

Bools = NDArray[np.bool_]
LIMITS = ((5.0, 0.2), (5.0, 0.05), (2.0, 0.02))  # degrees, longest sides; the first is the paper's
GROSS_DEG = 30.0


@dataclass(frozen=True)
class Scores:
    """One entry per pair, arrays (N,). Without a pose errors are 180 degrees and infinite."""

    rotation_deg: Float64
    translation: Float64
    symmetric_rotation_deg: Float64  # to the nearest pose that is right up to symmetry
    symmetric_translation: Float64
    overlap: Float64  # the true one, of the pair
    angle_deg: Float64  # of the true rotation
    same_crop: Int64  # 1: cropped towards the same side, 0: not, -1: does not apply
    symmetric_shape: Bools  # the shape has a group
    ms: Float64
    confidence: Float64  # NaN where the method has none
    ambiguous: Bools
    right_alternative: Bools  # an alternative is right (first limit, up to symmetry)
    nees: Float64  # NaN without a covariance; of poses that are right up to symmetry
    twin: Bools  # a wrong pose that places the shape nearly alike (twins.py), where asked for
    # How clearly the exact surface speaks against a wrong pose, nats (surface_evidence.py); NaN of
    # right ones, and where not asked for.
    against: Float64

    def __len__(self) -> int:
        return len(self.ms)

    def plain(self, limit: tuple[float, float] = LIMITS[0]) -> Bools:
        """Which poses are right."""
        return within(self.rotation_deg, self.translation, limit)

    def symmetric(self, limit: tuple[float, float] = LIMITS[0]) -> Bools:
        """Which poses are right up to the shape's symmetry."""
        nearest = within(self.symmetric_rotation_deg, self.symmetric_translation, limit)
        return np.asarray(nearest | self.plain(limit))

    def chosen(self, which: Bools) -> Scores:
        """Those pairs only."""
        return Scores(**{f.name: getattr(self, f.name)[which] for f in fields(self)})


def within(rotation_deg: Float64, translation: Float64, limit: tuple[float, float]) -> Bools:
    """Rotation error (degrees) and translation error both below their limits; NaN is not."""
    return np.asarray((rotation_deg < limit[0]) & (translation < limit[1]))


def concatenated(parts: Sequence[Scores]) -> Scores:
    """Scores one after another."""
    names = [f.name for f in fields(Scores)]
    return Scores(**{n: np.concatenate([getattr(part, n) for part in parts]) for n in names})


def score(
    pairs: Sequence[Pair],
    estimates: Sequence[Estimate],
    groups: Mapping[str, SymmetryGroup],
    shapes: ShapeSet | None = None,
) -> Scores:
    """Of pairs and a method's answers to them, in the same order; at least one.

    shapes: the split's, to tell the twins among the wrong poses and what the surface says of them
    (0.2 s each).
    """
    rows = [
        _one(pair, estimate, groups.get(pair.name, TRIVIAL), shapes)
        for pair, estimate in zip(pairs, estimates, strict=True)
    ]
    return Scores(*(np.array(column) for column in zip(*rows, strict=True)))


def _one(
    pair: Pair, estimate: Estimate, group: SymmetryGroup, shapes: ShapeSet | None
) -> tuple[float | int | bool, ...]:
    """The fields of Scores, in their order."""
    pose, truth = estimate.T_target_source, pair.T_target_source
    plain = symmetric = (180.0, np.inf)
    nees, twin, against = np.nan, False, np.nan
    if pose is not None:
        plain = (float(rotation_error_deg(pose, truth)), float(translation_error(pose, truth)))
        symmetric = group.errors(pose, truth)
        if estimate.covariance is not None and _right(symmetric):
            nees = squared_error(pose, group.nearest(pose, truth), estimate.covariance)
        if shapes is not None and not _right(symmetric):
            surface = shapes.surface[pair.shape]
            twin = is_twin(surface, pose, truth)
            against = evidence(Surface(surface), pair.target, truth, pose)
    return (
        *plain,
        *symmetric,
        pair.overlap,
        float(rotation_error_deg(truth, np.eye(4))),
        -1 if pair.same_crop is None else int(pair.same_crop),
        not group.trivial,
        estimate.ms,
        estimate.confidence,
        estimate.status == "ambiguous",
        any(_right(group.errors(other, truth)) for other in estimate.alternatives),
        nees,
        twin,
        against,
    )


def _right(errors: tuple[float, float]) -> bool:
    return errors[0] < LIMITS[0][0] and errors[1] < LIMITS[0][1]


def squared_error(estimate: Float64, truth: Float64, covariance: Float64) -> float:
    """The normalised estimation error squared e^T C^-1 e; 6 in the mean where C is right.

    truth = [exp(w) v; 0 1] estimate with e = (w, v), poses (4, 4), C (6, 6). NaN for a singular C.
    """
    move = truth @ np.linalg.inv(estimate)
    error = np.concatenate([Rotation.from_matrix(move[:3, :3]).as_rotvec(), move[:3, 3]])
    try:
        return float(error @ np.linalg.solve(covariance, error))
    except np.linalg.LinAlgError:
        return float("nan")
