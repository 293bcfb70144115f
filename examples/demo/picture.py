"""Before and after, from three sides, as one PNG."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SOURCE_COLOUR, TARGET_COLOUR = "#d1495b", "#00798c"
VIEWS = ((0, 1, "front"), (2, 1, "side"), (0, 2, "top"))

Points = NDArray[np.float64]


def draw(source: Points, target: Points, moved: Points, title: str, path: Path) -> None:
    """Source and target (N, 3), (M, 3) as given; below, the source moved (N, 3) onto the target."""
    figure, rows = plt.subplots(2, len(VIEWS), figsize=(11, 7.5), facecolor="white")
    for axes, cloud, label in ((rows[0], source, "before"), (rows[1], moved, "after")):
        for view, (i, j, name) in zip(axes, VIEWS, strict=True):
            view.scatter(target[:, i], target[:, j], s=1.5, c=TARGET_COLOUR, lw=0, label="target")
            view.scatter(cloud[:, i], cloud[:, j], s=1.5, c=SOURCE_COLOUR, lw=0, label="source")
            view.set_aspect("equal")
            view.set_axis_off()
            view.set_title(f"{label}, {name}", fontsize=11)
    handles, labels = rows[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, markerscale=6, loc="upper right", frameon=False)
    figure.suptitle(title, fontsize=12)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)
