"""Writes mug_1.xyz and mug_2.xyz: two independent, noisy scans of a mug from different sides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]

T_MUG_2_MUG_1 = np.array(
    [
        [0.36, 0.48, -0.80, 0.7],
        [-0.80, 0.60, 0.00, -0.2],
        [0.48, 0.64, 0.60, 1.1],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
"""(4, 4): maps the first scan onto the second; metres, as the scans."""


def mug(rng: np.random.Generator, count: int) -> Points:
    """(count, 3) points on a mug 0.1 m high: wall, bottom and handle, metres."""
    part = rng.choice(3, size=count, p=[0.68, 0.14, 0.18])
    turn = rng.uniform(0, 2 * np.pi, count)
    height = rng.uniform(0, 0.1, count)
    radius = 0.04 * np.sqrt(rng.uniform(0, 1, count))
    bend = rng.uniform(-0.5 * np.pi, 0.5 * np.pi, count)
    wall = np.stack([0.04 * np.cos(turn), 0.04 * np.sin(turn), height], axis=1)
    bottom = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * radius], axis=1)
    ring = 0.03 + 0.006 * np.cos(turn)
    handle = np.stack(
        [0.038 + ring * np.cos(bend), 0.006 * np.sin(turn), 0.05 + ring * np.sin(bend)], axis=1
    )
    return np.choose(part[:, None], [wall, bottom, handle])


def scan(rng: np.random.Generator, count: int, noise: float, view: Points, kept: float) -> Points:
    """(count, 3): the share `kept` of the mug that lies farthest along `view`, with noise."""
    points = mug(rng, int(count / kept) + 1)
    points = points[np.argsort(-points @ view)[:count]]
    return points + noise * rng.normal(size=points.shape)


def main() -> None:
    rng = np.random.default_rng(20)
    first = scan(rng, 1200, 0.0003, np.array([0.2, -0.6, 0.8]), kept=0.85)
    second = scan(rng, 1000, 0.0003, np.array([0.7, 0.5, 0.2]), kept=0.85)
    second = second @ T_MUG_2_MUG_1[:3, :3].T + T_MUG_2_MUG_1[:3, 3]
    folder = Path(__file__).parent
    for name, points in (("mug_1.xyz", first), ("mug_2.xyz", second)):
        np.savetxt(folder / name, points, fmt="%.5f")


if __name__ == "__main__":
    main()
