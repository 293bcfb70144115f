"""How much more training each missed bar would take, if recall went on growing as it last did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vnreg_train.evaluate.bars import LIMIT
from vnreg_train.evaluate.report import table
from vnreg_train.paper.published import BARS

Figures = Mapping[str, Any]
SPEED = "compiled, shared direction, bf16"  # the recipe of the shipped network's training


def points_per_doubling(curve: Sequence[Sequence[float]]) -> float:
    """Slope of a curve of [step, share] over the logarithm of the step, in points (0 to 100).

    By least squares over the latter half of the points: before, other settings were trained on.
    """
    steps, shares = np.array(curve[len(curve) // 2 :], dtype=np.float64).T
    return float(np.polyfit(np.log2(steps), 100 * shares, 1)[0])


def budget_table(figures: Figures) -> str:
    """A line for each bar that coarse + fine misses at 180 degrees."""
    slope = points_per_doubling(figures["curve"]["curves"]["coarse"]["recall"])
    pairs = figures["curve"]["pairs"]["coarse"]
    rate = figures["training_speed"]["recipes"][SPEED]["pairs_per_second"]
    lines = []
    for setting, bar in BARS.items():
        row = figures["recall"]["rows"][f"P0/{setting}/180"]["paper"]
        reached = 100 * row["plain"][LIMIT]["recall"]
        if reached < bar:
            doublings = (bar - reached) / slope
            needed = pairs * 2**doublings
            budget = [
                f"{doublings:.1f}",
                f"{round(needed, -3):,.0f}",
                f"{needed / rate / 3600:.1f}",
            ]
            lines.append([setting, f"{reached:.1f}", f"{bar:g}", *budget])
    head = ["180°", "reached", "bar", "doublings", "pairs in the coarse stage", "hours of one core"]
    return table(head, lines)
