"""Failures by category of the shape and kind of failure, as coloured tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vnreg_train.evaluate.failure_kinds import KINDS

CELL = (0.62, 0.24)  # inches
MARGIN = (1.6, 1.1)


def confusion(results: Mapping[str, Any]) -> Figure | None:
    """One table for each protocol: share of the category's pairs, in %, the darker the more."""
    tables = {pool: table for pool, table in results.get("categories", {}).items() if table}
    if not tables:
        return None
    kinds = KINDS[1:]
    rows = max(len(table) for table in tables.values())
    width = MARGIN[0] + len(tables) * (len(kinds) * CELL[0] + 0.2)
    size = (width, MARGIN[1] + rows * CELL[1])
    figure, axes = plt.subplots(1, len(tables), figsize=size, sharey=True, squeeze=False)
    names = sorted({name for table in tables.values() for name in table})
    for place, (pool, table) in zip(axes.flat, tables.items(), strict=True):
        _draw_table(place, pool, table, names)
    figure.tight_layout()
    return figure


def _draw_table(axes: Axes, pool: str, table: Mapping[str, Any], names: list[str]) -> None:
    kinds = KINDS[1:]
    counts = np.array([[table.get(n, {}).get(kind, 0) for kind in kinds] for n in names])
    pairs = np.array([table.get(n, {}).get("pairs", 0) for n in names])
    shares = 100 * counts / np.maximum(pairs, 1)[:, None]
    axes.pcolormesh(shares, cmap="Reds", vmin=0, vmax=30, edgecolors="white", linewidth=1)
    for (row, column), count in np.ndenumerate(counts):
        if count:
            colour = "white" if shares[row, column] > 18 else "black"
            text = f"{shares[row, column]:.1f}"
            axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", color=colour, size=7)
    axes.set_xticks(np.arange(len(kinds)) + 0.5, kinds, rotation=35, ha="right", size=7)
    axes.set_yticks(np.arange(len(names)) + 0.5, names, size=7)
    axes.set_title(f"{pool}: % of {pairs.sum():,} pairs", size=8)
    axes.invert_yaxis()
    axes.tick_params(length=0)
    axes.grid(False)
