"""The pictures of docs/results.md, as SVG that is the same for the same figures.

Text stays text and nothing depends on the day, so that a picture's diff is as small as its change.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("svg")

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from vnreg_train.evaluate.confusion_plot import confusion
from vnreg_train.evaluate.recall_plots import against_angle, against_noise, against_overlap
from vnreg_train.evaluate.reliability_plot import calibration

Draw = Callable[[Mapping[str, Any]], Figure | None]
STYLE: Any = {
    "svg.hashsalt": "vnreg",
    "svg.fonttype": "none",
    "font.size": 9,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.alpha": 0.3,
}
PLOTS: tuple[tuple[str, str, Draw], ...] = (
    ("Recall against the angle of the rotation", "angle.svg", against_angle),
    ("Recall up to symmetry against overlap, all cropped P1 rows", "overlap.svg", against_overlap),
    ("Recall up to symmetry against noise, P1", "noise.svg", against_noise),
    ("Reliability of mode verified's confidence", "reliability.svg", calibration),
    ("Failures of mode verified by category and kind", "categories.svg", confusion),
)


def draw_plots(results: Mapping[str, Any], folder: Path) -> list[tuple[str, str]]:
    """Writes every plot that the figures suffice for; (caption, file name) of each."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    with plt.rc_context(STYLE):
        for caption, name, draw in PLOTS:
            figure = draw(results)
            if figure is not None:
                about = {"Date": None, "Creator": None}
                figure.savefig(folder / name, metadata=about, bbox_inches="tight")
                plt.close(figure)
                written.append((caption, name))
    return written
