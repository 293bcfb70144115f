"""Pairs of clouds for parity, and how stages are compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from random_network import random_cloud
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

Stages = Mapping[str, NDArray[np.generic]]
Points = NDArray[np.float64]
COINCIDENT = 1e-3  # below this distance float32 knows no direction between two points
# Below it matched points lie on a line or collapse, and rounding turns the fitted rotation at will.
UNDETERMINED = 1e-3
SIDES = ("source", "target")


@dataclass(frozen=True)
class TestPair:
    """source (N, 3), target (M, 3), in units and frames of their own."""

    __test__ = False

    source: Points
    target: Points


def make_test_pair(seed: int, source_points: int, target_points: int, noisy: bool) -> TestPair:
    """Two samples of one shape at a random pose, in random order.

    Clean: the smaller cloud is a part of the larger one, moved. Noisy: noise of 1 % on both.
    """
    rng = np.random.default_rng([seed, source_points, target_points, noisy])
    cloud = random_cloud(rng, max(source_points, target_points))
    source, target = cloud[:source_points].copy(), cloud[:target_points].copy()
    if noisy:
        source += rng.normal(0, 0.01, source.shape)
        target += rng.normal(0, 0.01, target.shape)
    rotation = Rotation.random(rng=rng).as_matrix()
    target = target @ rotation.T + rng.uniform(-0.5, 0.5, 3)
    return TestPair(rng.permutation(source), rng.permutation(target))


def has_neighbour_ties(points: Points, k: int, margin: float = 1e-5) -> bool:
    """Whether a rounding of relative size `margin` could change some point's k nearest points."""
    distance, _ = cKDTree(points).query(points, k + 1)
    return bool((distance[:, k] < distance[:, k - 1] * (1 + margin)).any())


def cloud_without_ties(seed: int, count: int, k: int) -> Points:
    """The first cloud from `seed` on whose neighbourhoods no rounding changes, (count, 3)."""
    while True:
        cloud = random_cloud(np.random.default_rng([seed, count]), count)
        if not has_neighbour_ties(cloud, k):
            return cloud
        seed += 1


def normalised_error(actual: NDArray[np.generic], expected: NDArray[np.generic]) -> float:
    """||a - b|| / ||b||; infinite for NaN and for other shapes; 0 / 0 is 0."""
    if actual.shape != expected.shape:
        return np.inf
    difference = float(np.linalg.norm(actual.astype(float) - expected.astype(float)))
    size = float(np.linalg.norm(expected.astype(float)))
    if not np.isfinite(difference) or not np.isfinite(size):
        return np.inf
    return difference / size if size > 0 else (0.0 if difference == 0 else np.inf)


def rotation_difference_deg(a: NDArray[np.generic], b: NDArray[np.generic]) -> float:
    """Angle between the rotations of two poses (4, 4)."""
    turn = Rotation.from_matrix(a[:3, :3].astype(float).T @ b[:3, :3].astype(float))
    return float(np.degrees(turn.magnitude()))


def iterations(stages: Stages) -> int:
    return sum(name.startswith("fine.") and name.endswith(".T") for name in stages)


def by_index(stages: Stages) -> dict[str, NDArray[np.generic]]:
    """The fine register's stages with the kept points in the order of their indices.

    The order of `kept` is by significance, where rounding may swap two points; what the fine
    register computes does not depend on it, apart from that order.
    """
    kept = {side: stages[f"{side}.kept"].astype(int) for side in ("source", "target")}
    rows, columns = np.argsort(kept["source"]), np.argsort(kept["target"])
    ordered: dict[str, NDArray[np.generic]] = {
        "source.kept": kept["source"][rows],
        "target.kept": kept["target"][columns],
    }
    for index in range(iterations(stages)):
        name = f"fine.{index}"
        match = stages[f"{name}.match"].astype(int)
        ordered[f"{name}.similarity"] = stages[f"{name}.similarity"][rows][:, columns]
        ordered[f"{name}.match"] = kept["target"][match][rows]
        ordered[f"{name}.weight"] = stages[f"{name}.weight"][rows]
        ordered[f"{name}.T"] = stages[f"{name}.T"]
    return ordered


def kept_points(stages: Stages, index: int) -> tuple[Points, Points]:
    """Kept points before iteration `index`: the source moved by the pose so far, and the target."""
    pose = stages["coarse.T" if index == 0 else f"fine.{index - 1}.T"].astype(float)
    x = stages["source.points"].astype(float)[stages["source.kept"].astype(int)]
    y = stages["target.points"].astype(float)[stages["target.kept"].astype(int)]
    return x @ pose[:3, :3].T + pose[:3, 3], y


def kept_distances(stages: Stages, index: int) -> Points:
    """Distances (Ks, Kt) between kept points before iteration `index`, network coordinates."""
    x, y = kept_points(stages, index)
    return np.linalg.norm(x[:, None] - y[None], axis=-1)


def covariance(stages: Stages, index: int) -> Points:
    """H (3, 3) of the weighted Procrustes of iteration `index`."""
    x, y = kept_points(stages, index)
    y = y[stages[f"fine.{index}.match"].astype(int)]
    w = stages[f"fine.{index}.weight"].astype(float)[:, None]
    w = w / w.sum()
    return (w * (y - (w * y).sum(0))).T @ (x - (w * x).sum(0))


def determination(stages: Stages, index: int) -> float:
    """How well iteration `index` determines its rotation: 0 not at all, 1 at most.

    The second singular value of H, plus or minus the third, over the first: where it vanishes, the
    matched points lie on a line or collapse, and many rotations fit alike.
    """
    h = covariance(stages, index)
    u, s, vt = np.linalg.svd(h)
    return float((s[1] + np.sign(np.linalg.det(u @ vt)) * s[2]) / s[0]) if s[0] > 0 else 0.0


def same_choices(a: Stages, b: Stages) -> bool:
    """Whether the discrete choices agree: kept points, matches, and which weights are zero.

    Up to the first iteration whose matches do not determine a rotation: what follows it starts from
    an arbitrary pose.
    """
    x, y = by_index(a), by_index(b)
    if not all(np.array_equal(x[f"{side}.kept"], y[f"{side}.kept"]) for side in SIDES):
        return False
    for index in range(iterations(a)):
        match, weight = f"fine.{index}.match", f"fine.{index}.weight"
        if not np.array_equal(x[match], y[match]):
            return False
        if not np.array_equal(x[weight] == 0, y[weight] == 0):
            return False
        if determination(a, index) < UNDETERMINED:
            return True
    return True


def determined(stages: Stages) -> bool:
    """Whether the matches of every iteration determine its rotation."""
    return all(determination(stages, i) >= UNDETERMINED for i in range(iterations(stages)))
