"""How often poses of a stated confidence are right."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from vnreg_train.evaluate.bars import METHOD
from vnreg_train.evaluate.measures import wilson_lengths

SQUARE = (4.0, 4.0)
POOLS = ("P0", "P1", "views")


def calibration(results: Mapping[str, Any]) -> Figure | None:
    """Share of right poses against confidence, each protocol apart; circles by numbers of pairs,
    bars for the 95 % Wilson intervals."""
    pools = results["pooled"].get(METHOD, {})
    found = {name: pools[name]["confidence"] for name in POOLS if name in pools}
    found = {name: figures for name, figures in found.items() if figures}
    if not found:
        return None
    figure, axes = plt.subplots(figsize=SQUARE)
    axes.plot([0, 1], [0, 1], color="grey", linewidth=0.8)
    for k, (name, figures) in enumerate(found.items()):
        bins = figures["bins"]
        x, y, pairs = bins["confidence"], bins["right"], bins["pairs"]
        reach = wilson_lengths([(round(s * n), n) for s, n in zip(y, pairs, strict=True)])
        axes.errorbar(x, y, yerr=reach, color=f"C{k}", linewidth=0.8, elinewidth=0.8)
        sizes = [10 + 200 * n / figures["pairs"] for n in pairs]
        label = f"{name}: ECE {figures['ece']:.3f}"
        axes.scatter(x, y, s=sizes, alpha=0.6, color=f"C{k}", label=label)
    axes.set(xlabel="confidence", ylabel="share of right poses", xlim=(0, 1.02), ylim=(0, 1.02))
    axes.legend(loc="lower right")
    return figure
