"""The pictures of docs/results.md, as SVG that is the same for the same figures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("svg")

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from vnreg_train.evaluate.bars import METHOD
from vnreg_train.evaluate.report import TITLES

STYLE: Any = {"svg.hashsalt": "vnreg", "font.size": 9, "axes.grid": True, "grid.alpha": 0.3}
WIDE, SQUARE = (6.4, 3.6), (4.0, 4.0)


def draw_plots(results: Mapping[str, Any], folder: Path) -> list[tuple[str, str]]:
    """Writes every plot that the figures suffice for; (caption, file name) of each."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    with plt.rc_context(STYLE):
        for caption, name, draw in (
            ("Recall up to symmetry against overlap, all cropped P1 rows", "overlap.svg", overlap),
            ("Reliability of mode verified's confidence", "reliability.svg", calibration),
        ):
            figure = draw(results)
            if figure is not None:
                figure.savefig(folder / name, metadata={"Date": None}, bbox_inches="tight")
                plt.close(figure)
                written.append((caption, name))
    return written


def overlap(results: Mapping[str, Any]) -> Figure | None:
    """Recall in bins of the true overlap, one line per method, the P1 partial rows together."""
    rows = [of for name, of in results["rows"].items() if name.startswith("P1/partial")]
    methods = [method for method in TITLES if any(method in of for of in rows)]
    if not methods:
        return None
    figure, axes = plt.subplots(figsize=WIDE)
    for method in methods:
        sums: dict[float, list[int]] = {}
        for found in (b for of in rows if method in of for b in of[method]["by_overlap"]):
            total = sums.setdefault((found["from"] + found["to"]) / 2, [0, 0])
            total[0] += found["hits"]
            total[1] += found["pairs"]
        middles = sorted(sums)
        shares = [100 * sums[middle][0] / sums[middle][1] for middle in middles]
        width = 2.5 if method == METHOD else 1.0
        label = TITLES[method].strip("*")
        axes.plot(middles, shares, marker="o", markersize=3, linewidth=width, label=label)
    axes.set(xlabel="true overlap", ylabel="recall, %", xlim=(0, 1), ylim=(0, 102))
    axes.legend(fontsize=7)
    return figure


def calibration(results: Mapping[str, Any]) -> Figure | None:
    """Share of right poses against confidence, P0 and P1 apart; circles by numbers of pairs."""
    pools = results["pooled"].get(METHOD, {})
    found = {name: pools[name]["confidence"] for name in ("P0", "P1") if name in pools}
    if not any(found.values()):
        return None
    figure, axes = plt.subplots(figsize=SQUARE)
    axes.plot([0, 1], [0, 1], color="grey", linewidth=0.8)
    for name, figures in found.items():
        if figures:
            bins = figures["bins"]
            sizes = [10 + 200 * n / figures["pairs"] for n in bins["pairs"]]
            label = f"{name}: ECE {figures['ece']:.3f}"
            axes.plot(bins["confidence"], bins["right"], linewidth=0.8)
            axes.scatter(bins["confidence"], bins["right"], s=sizes, alpha=0.6, label=label)
    axes.set(xlabel="confidence", ylabel="share of right poses", xlim=(0, 1.02), ylim=(0, 1.02))
    axes.legend(loc="upper left")
    return figure
