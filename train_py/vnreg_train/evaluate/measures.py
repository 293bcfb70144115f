"""The figures of one method on one row, and of a method's confidence over rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from vnreg_train.data.mesh import Float64
from vnreg_train.evaluate.confidence import auroc, reliability
from vnreg_train.evaluate.scores import GROSS_DEG, LIMITS, Bools, Scores
from vnreg_train.evaluate.surface_evidence import TOLD

OVERLAP_EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
ANGLE_EDGES = (0.0, 45.0, 90.0, 135.0, 180.0)
NEES_DIMENSIONS = 6
NEAR_DEG = 15.0


def wilson_interval(hits: int, trials: int, z: float = 1.959964) -> tuple[float, float]:
    """The 95 % interval of a share, in 0..1; never empty, also for 0 or all hits."""
    if not 0 <= hits <= trials or trials == 0:
        raise ValueError(f"expected 0 <= hits <= trials > 0, got {hits} of {trials}")
    share = hits / trials
    middle = share + z * z / (2 * trials)
    spread = z * math.sqrt(share * (1 - share) / trials + z * z / (4 * trials * trials))
    scale = 1 + z * z / trials
    return max(0.0, (middle - spread) / scale), min(1.0, (middle + spread) / scale)


def wilson_lengths(counts: Sequence[tuple[int, int]]) -> tuple[list[float], list[float]]:
    """How far the intervals of (hits, trials) reach below and above the shares; for error bars."""
    ends = [(hits / trials, *wilson_interval(hits, trials)) for hits, trials in counts]
    below = [max(0.0, middle - low) for middle, low, _ in ends]
    return below, [max(0.0, high - middle) for middle, _, high in ends]


def limit_name(limit: tuple[float, float]) -> str:
    return f"{limit[0]:g} deg, {limit[1]:g}"


def share(which: Bools) -> dict[str, Any]:
    """How many of how many, with the Wilson interval; for the JSON."""
    hits, pairs = int(which.sum()), len(which)
    return {
        "hits": hits,
        "pairs": pairs,
        "recall": hits / pairs,
        "interval_95": list(wilson_interval(hits, pairs)),
    }


def measure(scores: Scores) -> dict[str, Any]:
    """Everything about one method on one row that the report tells; for the JSON."""
    return {
        "pairs": len(scores),
        "plain": {limit_name(limit): share(scores.plain(limit)) for limit in LIMITS},
        "symmetric": {limit_name(limit): share(scores.symmetric(limit)) for limit in LIMITS},
        "rotation_deg": _quantiles(scores.rotation_deg),
        "translation": _quantiles(scores.translation),
        "symmetric_rotation_deg": _quantiles(scores.symmetric_rotation_deg),
        "symmetric_translation": _quantiles(scores.symmetric_translation),
        "gross": share(scores.rotation_deg > GROSS_DEG),
        "symmetric_gross": share(scores.symmetric_rotation_deg > GROSS_DEG),
        "ms": _quantiles(scores.ms),
        "halves": _halves(scores),
        "by_overlap": binned_recall(scores, scores.overlap, OVERLAP_EDGES),
        "by_angle": binned_recall(scores, scores.angle_deg, ANGLE_EDGES),
        "failures": failures(scores),
        "confidence": confidence(scores),
        "nees": nees(scores),
    }


def _quantiles(values: Float64) -> dict[str, float | None]:
    """Median and 95th percentile, infinite ones (no pose) as None."""
    found = np.quantile(values, [0.5, 0.95], method="higher")
    return {
        name: float(value) if np.isfinite(value) else None
        for name, value in zip(("median", "p95"), found, strict=True)
    }


def _halves(scores: Scores) -> dict[str, Any] | None:
    """Plain recall of P0 partial, apart by whether both clouds were cropped alike."""
    if (scores.same_crop < 0).all():
        return None
    right = scores.plain()
    return {
        name: share(right[scores.same_crop == half])
        for name, half in (("same", 1), ("opposite", 0))
        if (scores.same_crop == half).any()
    }


def binned_recall(
    scores: Scores, values: Float64, edges: tuple[float, ...]
) -> list[dict[str, Any]]:
    """Recall up to symmetry in bins of the pairs' values (N,); empty bins are left out."""
    last = len(edges) - 2
    index = np.clip(np.digitize(values, edges) - 1, 0, last)
    right = scores.symmetric()
    return [
        {"from": edges[k], "to": edges[k + 1], **share(right[index == k])}
        for k in range(last + 1)
        if (index == k).any()
    ]


def failures(scores: Scores) -> dict[str, int]:
    """Where the pairs that are not right up to symmetry were lost.

    Each pair counts where it fits first. no_pose. near: within NEAR_DEG of a right pose, so the
    refinement lost it. alternative: a right pose was found, refined and listed, but not chosen.
    ambiguous: none was listed, but the method says that several poses fit. wrong: neither. And
    twins: how many of them all place the shape nearly as a right pose does. untold: of how many
    not even the exact surface says clearly that they are wrong.
    """
    left = wrong = ~scores.symmetric()
    counts = {}
    for name, which in (
        ("no_pose", ~np.isfinite(scores.translation)),
        ("near", scores.symmetric_rotation_deg < NEAR_DEG),
        ("alternative", scores.right_alternative),
        ("ambiguous", scores.ambiguous),
        ("wrong", np.ones_like(left)),
    ):
        counts[name] = int((left & which).sum())
        left = left & ~which
    counts["twins"] = int((scores.twin & wrong).sum())
    counts["untold"] = int(((scores.against < TOLD) & wrong).sum())
    return counts


def confidence(scores: Scores) -> dict[str, Any] | None:
    """AUROC, ECE and reliability diagram of "right up to symmetry"; None without confidences."""
    known = np.isfinite(scores.confidence)
    if not known.any():
        return None
    right, values = scores.symmetric()[known], scores.confidence[known]
    diagram = reliability(values, right)
    ranking = auroc(values, right)
    return {
        "pairs": int(known.sum()),
        "auroc": None if math.isnan(ranking) else ranking,
        "ece": diagram.error,
        "bins": {
            "confidence": diagram.confidence.tolist(),
            "right": diagram.right.tolist(),
            "pairs": diagram.pairs.tolist(),
        },
    }


def nees(scores: Scores) -> dict[str, Any] | None:
    """Normalised estimation error squared of right poses; its mean should be 6."""
    values = scores.nees[np.isfinite(scores.nees)]
    if not values.size:
        return None
    return {
        "pairs": int(values.size),
        "mean": float(values.mean()),
        "median": float(np.median(values)),
    }
