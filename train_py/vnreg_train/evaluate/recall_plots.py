"""Recall against what makes a pair hard, a line for each method, with 95 % Wilson intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from vnreg_train.data.protocol import ANGLES_DEG
from vnreg_train.evaluate.bars import LIMIT, METHOD
from vnreg_train.evaluate.measures import ANGLE_EDGES, OVERLAP_EDGES, wilson_lengths
from vnreg_train.evaluate.rows import P1_FACTORS, PAPER_SETTINGS
from vnreg_train.evaluate.titles import TITLES, plain_title

Results = Mapping[str, Any]
Counts = tuple[int, int]  # right pairs, pairs
Line = list[tuple[float, Counts]]  # of one method: where on the axis, and the counts there
PANEL = 2.6  # inches
SPREAD = 0.012  # of the axis, between the methods, so that their intervals do not hide each other
COLOURS = {name: f"C{k}" for k, name in enumerate(TITLES)}
# Shares of the surface that are kept, and the rows of each by their noise.
NOISE_ROWS = {
    kept: sorted(
        (f.noise, f"P1/{name}")
        for name, f in P1_FACTORS.items()
        if f.kept == kept and f.target_points == 1024 and not f.uneven and not f.outliers
    )
    for kept in (1.0, 0.75, 0.5)
}


def against_angle(results: Results) -> Figure | None:
    """P0 by its largest Euler angle, plain recall; P1 by the angle of the true rotation."""
    panels = {}
    for setting in PAPER_SETTINGS:
        rows = [(angle, f"P0/{setting}/{angle}") for angle in ANGLES_DEG]
        panels[f"P0 {setting}"] = _by_rows(results, rows, "plain")
    panels["P1, all rows"] = _by_bins(results, "P1/", "by_angle")
    label = "largest Euler angle; P1: angle of the rotation, degrees"
    return _panels(panels, label, (0.0, 195.0), ANGLE_EDGES)


def against_overlap(results: Results) -> Figure | None:
    """In bins of the true overlap, the P1 partial rows together."""
    panels = {"P1, cropped clouds": _by_bins(results, "P1/partial", "by_overlap")}
    return _panels(panels, "true overlap", (0.0, 1.0), OVERLAP_EDGES)


def against_noise(results: Results) -> Figure | None:
    """P1 by the standard deviation of the noise, for each share of the surface that is kept."""
    panels = {
        "whole" if kept == 1 else f"{kept:.0%} kept": _by_rows(results, rows, "symmetric")
        for kept, rows in NOISE_ROWS.items()
    }
    label = "noise, in longest sides of the shape"
    return _panels(panels, label, (-0.0015, 0.0215), (0.0, 0.01, 0.02))


def _by_rows(results: Results, rows: Sequence[tuple[float, str]], kind: str) -> dict[str, Line]:
    """The line of each method through rows at (place, name)."""
    lines: dict[str, Line] = {}
    for method in TITLES:
        found = [(x, results["rows"].get(name, {}).get(method)) for x, name in rows]
        line = [(float(x), _counts(of[kind][LIMIT])) for x, of in found if of is not None]
        if line:
            lines[method] = line
    return lines


def _by_bins(results: Results, prefix: str, key: str) -> dict[str, Line]:
    """The line of each method through the middles of bins, over all rows with this prefix."""
    rows = [of for name, of in results["rows"].items() if name.startswith(prefix)]
    lines: dict[str, Line] = {}
    for method in TITLES:
        bins = [b for of in rows if method in of for b in of[method][key]]
        sums: dict[float, Counts] = {}
        for b in bins:
            middle = (b["from"] + b["to"]) / 2
            hits, pairs = sums.get(middle, (0, 0))
            sums[middle] = (hits + b["hits"], pairs + b["pairs"])
        if sums:
            lines[method] = sorted(sums.items())
    return lines


def _counts(found: Mapping[str, Any]) -> Counts:
    return found["hits"], found["pairs"]


def _panels(
    panels: Mapping[str, Mapping[str, Line]],
    label: str,
    limits: tuple[float, float],
    ticks: Sequence[float],
) -> Figure | None:
    """Panels side by side that have any line, with one legend beside them."""
    drawn = {title: lines for title, lines in panels.items() if lines}
    if not drawn:
        return None
    columns = min(3, len(drawn))
    rows = -(-len(drawn) // columns)
    size = (max(5.0, PANEL * columns + 2.2), PANEL * rows + 0.5)
    figure, axes = plt.subplots(rows, columns, figsize=size, sharey=True, squeeze=False)
    for place, (title, lines) in zip(axes.flat, drawn.items(), strict=False):
        _draw_lines(place, lines, limits[1] - limits[0])
        place.set(title=title, xlim=limits, xticks=ticks, ylim=(0, 102))
    for place in list(axes.flat)[len(drawn) :]:
        place.set_visible(False)
    for row in axes:
        row[0].set_ylabel("recall, %")
    figure.supxlabel(label, fontsize=9)
    methods = [m for m in TITLES if any(m in lines for lines in drawn.values())]
    _legend(figure, methods)
    figure.tight_layout()
    return figure


def _draw_lines(axes: Axes, lines: Mapping[str, Line], width: float) -> None:
    for k, (method, line) in enumerate(lines.items()):
        shift = (k - (len(lines) - 1) / 2) * SPREAD * width
        reach = np.array(wilson_lengths([counts for _, counts in line]))
        axes.errorbar(
            [x + shift for x, _ in line],
            [100 * hits / pairs for _, (hits, pairs) in line],
            yerr=100 * reach,
            color=COLOURS[method],
            linewidth=2.2 if method == METHOD else 1.0,
            elinewidth=0.8,
            marker="o",
            markersize=3,
            zorder=3 if method == METHOD else 2,
        )


def _legend(figure: Figure, methods: Sequence[str]) -> None:
    handles = [
        Line2D(
            [],
            [],
            color=COLOURS[m],
            linewidth=2.2 if m == METHOD else 1.0,
            marker="o",
            markersize=3,
            label=plain_title(m),
        )
        for m in methods
    ]
    figure.legend(handles=handles, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
