"""The rows of the evaluation: what the two clouds of a pair have against them.

`P0/SETTING/ANGLE` is the paper's protocol (`vnreg_train.data.protocol`). `P1/NAME` is the honest
one (`vnreg_train.evaluate.pairs`): disjoint samples of the surface, any rotation, and the factors
below, each alone and together. `views/NAME` is P1 with clouds that show only what one viewpoint
sees, as a depth camera's do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from vnreg_train.data.protocol import ANGLES_DEG

PAPER_SETTINGS = ("clean", "noisy", "independent", "partial")


@dataclass(frozen=True)
class Factors:
    """How a P1 pair is made harder than two disjoint even samples of 1,024 points each."""

    noise: float = 0.0  # standard deviation per coordinate, in longest sides of the shape
    kept: float = 1.0  # share of the surface that each cloud's own crop leaves
    target_points: int = 1024
    uneven: bool = False  # density falls along a direction, by pairs.DENSITY_RATIO
    outliers: float = 0.0  # share of the points that lie anywhere
    views: int = 0  # 1: the source shows what one viewpoint sees; 2: each cloud, from its own


@dataclass(frozen=True)
class Row:
    """One row of the tables: a P0 setting with its largest Euler angle, or P1 factors."""

    name: str
    setting: str
    max_angle_deg: float
    factors: Factors | None = None

    @property
    def protocol(self) -> str:
        return self.name.split("/")[0]


P1_FACTORS = {
    "independent": Factors(),
    "noise_0.01": Factors(noise=0.01),
    "noise_0.02": Factors(noise=0.02),
    "density": Factors(target_points=512),
    "uneven": Factors(uneven=True),
    "outliers": Factors(outliers=0.1),
    "partial_75": Factors(kept=0.75),
    "partial_50": Factors(kept=0.5),
    "partial_75_noise_0.01": Factors(kept=0.75, noise=0.01),
    "partial_50_noise_0.01": Factors(kept=0.5, noise=0.01),
    "all": Factors(noise=0.01, kept=0.75, target_points=512, uneven=True, outliers=0.1),
}

VIEW_FACTORS = {
    "scan_to_model": Factors(noise=0.005, views=1),
    "two_scans": Factors(noise=0.005, views=2),
}

ROWS = {
    row.name: row
    for row in [
        Row(f"P0/{setting}/{angle}", setting, float(angle))
        for setting in PAPER_SETTINGS
        for angle in ANGLES_DEG
    ]
    + [
        Row(f"{protocol}/{name}", name, 180.0, factors)
        for protocol, rows in (("P1", P1_FACTORS), ("views", VIEW_FACTORS))
        for name, factors in rows.items()
    ]
}
# The rows that the project has set itself a bar for.
BAR_ROWS = (
    *(f"P0/{setting}/180" for setting in PAPER_SETTINGS),
    "P1/noise_0.01",
    "P1/partial_75_noise_0.01",
    "P1/partial_50_noise_0.01",
)
GROUPS = {"all": tuple(ROWS), "bars": BAR_ROWS}


def select_rows(patterns: Sequence[str]) -> list[Row]:
    """The rows, in the tables' order, that any pattern names.

    A pattern is `all`, `bars`, a protocol (`p1`), or a row's name with wildcards (`P0/*/180`);
    capitals do not matter. Raises ValueError for a pattern that names none.
    """
    chosen: set[str] = set()
    for pattern in patterns:
        names = GROUPS.get(pattern) or [name for name in ROWS if _matches(name, pattern)]
        if not names:
            raise ValueError(f"no row is called {pattern!r}; known are {', '.join(ROWS)}")
        chosen.update(names)
    return [row for name, row in ROWS.items() if name in chosen]


def _matches(name: str, pattern: str) -> bool:
    name, pattern = name.lower(), pattern.lower()
    return name.startswith(f"{pattern}/") or fnmatchcase(name, pattern)
