"""The pictures of docs/benchmark.md, as SVG that is the same for the same figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("svg")

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import ScalarFormatter

Report = Mapping[str, Any]
STYLE: Any = {"svg.hashsalt": "vnreg", "font.size": 9, "axes.grid": True, "grid.alpha": 0.3}
SIZE = (6.4, 3.6)


def draw_plots(report: Report, folder: Path) -> dict[str, str]:
    """Writes every plot that the run suffices for; file name by part of the run."""
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    with plt.rc_context(STYLE):
        for part, draw in PLOTS.items():
            if part.split("-")[0] not in report:
                continue
            figure, axes = plt.subplots(figsize=SIZE)
            draw(report, axes)
            name = f"{part}.svg"
            figure.savefig(folder / name, metadata={"Date": None}, bbox_inches="tight")
            plt.close(figure)
            written[part] = name
    return written


def series(times: Mapping[str, Mapping[str, float]]) -> dict[str, tuple[list[int], list[float]]]:
    """`label/number` -> medians: (numbers, milliseconds) of each label."""
    found: dict[str, tuple[list[int], list[float]]] = {}
    for key, of in times.items():
        label, _, number = key.rpartition("/")
        numbers, ms = found.setdefault(label, ([], []))
        numbers.append(int(number))
        ms.append(of["median"])
    return found


def _lines(axes: Axes, times: Mapping[str, Mapping[str, float]], xlabel: str) -> None:
    for label, (numbers, ms) in series(times).items():
        axes.plot(numbers, ms, marker="o", markersize=3, label=label or None)
    axes.set(xlabel=xlabel, ylabel="ms, median", xscale="log", yscale="log")
    axes.set_xticks(sorted({n for numbers, _ in series(times).values() for n in numbers}))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(ScalarFormatter())
    axes.minorticks_off()


def _points(report: Report, axes: Axes) -> None:
    _lines(axes, report["points"]["times"], "points of each cloud")
    axes.tick_params(axis="x", rotation=30)
    axes.legend()


def _channels(report: Report, axes: Axes) -> None:
    of = report["channels"]
    encode = {f"encode/{c}": {"median": ms} for c, ms in of["encode"].items()}
    whole = {f"paper mode/{c}": t for c, t in of["times"].items()}
    _lines(axes, whole | encode, "channels C of the paper's network")
    axes.legend()


def _threads(report: Report, axes: Axes) -> None:
    found = series(report["threads"]["times"])
    width = 0.8 / len(found)
    for position, (label, (threads, ms)) in enumerate(found.items()):
        axes.bar([t + (position - 1.5) * width for t in threads], ms, width, label=label)
    counts = sorted({t for threads, _ in found.values() for t in threads})
    axes.set(xlabel="threads", ylabel="ms, median", xticks=counts)
    axes.legend()


def _stages(report: Report, axes: Axes) -> None:
    """Stacked bars, one for each mode at 1,024 points."""
    of = {k: v for k, v in report["points"]["stages"].items() if k.endswith("/1024")}
    names = [name for name in next(iter(of.values())) if name != "total"]
    left = [0.0] * len(of)
    for name in names:
        ms = [stages.get(name, 0.0) for stages in of.values()]
        if max(ms) > 0:
            axes.barh([key.split("/")[0] for key in of], ms, left=left, label=name)
        left = [a + b for a, b in zip(left, ms, strict=True)]
    axes.set(xlabel="ms, median, 1,024 points, one thread")
    axes.invert_yaxis()
    axes.legend(ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def _latency(report: Report, axes: Axes) -> None:
    for name, of in report["latency"]["series"].items():
        edges, counts = of["histogram"]["edges"], of["histogram"]["counts"]
        axes.stairs(counts, edges, label=name, fill=True, alpha=0.5)
    axes.set(xlabel="ms", ylabel="calls", xscale="log", yscale="log")
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_formatter(ScalarFormatter())
    axes.legend()


PLOTS: dict[str, Callable[[Report, Axes], None]] = {
    "points": _points,
    "points-stages": _stages,
    "channels": _channels,
    "threads": _threads,
    "latency": _latency,
}
