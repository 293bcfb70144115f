"""What a method says about a pair, as it stands in the files of a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vnreg_train.data.mesh import Float64


@dataclass(frozen=True)
class Estimate:
    """One method's answer to one pair.

    T_target_source: (4, 4), None without a pose. ms: processor time of the call on one thread.
    The rest is what this engine tells and peers do not. covariance: (6, 6), rotation vector in
    radians, then translation: T_true = [exp(w) v; 0 1] T_target_source.
    """

    T_target_source: Float64 | None
    ms: float
    status: str = "ok"
    confidence: float = float("nan")
    evidence: dict[str, float] = field(default_factory=dict)
    covariance: Float64 | None = None
    alternatives: tuple[Float64, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Poses as their upper three rows, all numbers at full precision."""
        return {
            "pose": _rows(self.T_target_source),
            "ms": self.ms,
            "status": self.status,
            "confidence": None if np.isnan(self.confidence) else self.confidence,
            "evidence": self.evidence,
            "covariance": None if self.covariance is None else self.covariance.tolist(),
            "alternatives": [_rows(pose) for pose in self.alternatives],
        }

    @staticmethod
    def from_json(content: dict[str, Any]) -> Estimate:
        """The inverse of to_json."""
        covariance, confidence = content["covariance"], content["confidence"]
        return Estimate(
            T_target_source=_pose(content["pose"]),
            ms=content["ms"],
            status=content["status"],
            confidence=float("nan") if confidence is None else confidence,
            evidence=content["evidence"],
            covariance=None if covariance is None else np.array(covariance),
            alternatives=tuple(
                np.array([*rows, [0, 0, 0, 1.0]]) for rows in content["alternatives"]
            ),
        )


def _rows(pose: Float64 | None) -> list[list[float]] | None:
    return None if pose is None else np.asarray(pose, np.float64)[:3].tolist()


def _pose(rows: list[list[float]] | None) -> Float64 | None:
    return None if rows is None else np.array([*rows, [0, 0, 0, 1.0]])
