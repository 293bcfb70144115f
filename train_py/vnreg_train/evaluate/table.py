"""The short table of a run, for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vnreg_train.data.protocol import Pair
from vnreg_train.evaluate.scores import GROSS_DEG, LIMITS, Bools, Scores

HEAD = (
    f"{'row':<26}{'method':<12}{'pairs':>5} {'sym':>6} {'5/.2':>6} {'5/.05':>6} {'2/.02':>6}"
    f" {'sym2':>6} {'>30':>5} {'oracle':>6} {'ambig':>5} {'med':>6} {'p95':>6} {'ms':>7}"
)
LEGEND = (
    "sym: recall % at 5 deg/0.2 up to symmetry; 5/.2, 5/.05, 2/.02: plain recall; sym2: at 2 "
    "deg/0.02 up to symmetry; >30: gross failures % up to symmetry; oracle: right pose returned or "
    "among the alternatives; ambig: status ambiguous; med, p95: rotation error up to symmetry; "
    "ms: median processor time"
)


def line(row: str, method: str, scores: Scores) -> str:
    """One line under HEAD."""
    right = scores.symmetric()
    figures = [
        _percent(right),
        *(_percent(scores.plain(limit)) for limit in LIMITS),
        _percent(scores.symmetric(LIMITS[2])),
    ]
    gross, ambiguous = scores.symmetric_rotation_deg > GROSS_DEG, scores.ambiguous
    median, worst = np.quantile(scores.symmetric_rotation_deg, [0.5, 0.95])
    return (
        f"{row:<26}{method:<12}{len(scores):>5} {' '.join(figures)} {_percent(gross)[1:]}"
        f" {_percent(right | scores.right_alternative)} {_percent(ambiguous)[1:]}"
        f" {median:>6.2f} {worst:>6.1f} {np.median(scores.ms):>7.1f}"
    )


def failure_lines(pairs: Sequence[Pair], scores: Scores) -> list[str]:
    """One line for each pair that is not right up to symmetry."""
    return [
        f"    {pairs[k].shape:>4} {pairs[k].name:<60} {scores.symmetric_rotation_deg[k]:6.1f} deg"
        f" {scores.symmetric_translation[k]:6.3f}  overlap {scores.overlap[k]:.2f}"
        f"  confidence {scores.confidence[k]:.2f}"
        f"{'  ambiguous' if scores.ambiguous[k] else ''}"
        f"{'  twin' if scores.twin[k] else ''}"
        f"{'  right alternative' if scores.right_alternative[k] else ''}"
        for k in np.flatnonzero(~scores.symmetric()).tolist()
    ]


def _percent(which: Bools) -> str:
    return f"{100 * which.mean():>6.1f}"
