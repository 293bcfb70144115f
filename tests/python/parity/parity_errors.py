"""How far one stage of the engine is from torch's, computed from the engine's own inputs."""

from __future__ import annotations

import numpy as np
from parity_pairs import (
    COINCIDENT,
    Stages,
    covariance,
    determination,
    kept_distances,
    kept_points,
    normalised_error,
)

# Below it, rounding of 1e-5 could turn a fitted rotation noticeably.
DETERMINED = 1e-2


def error_alone(name: str, actual: Stages, expected: Stages) -> float:
    """The normalised error, without what float32 leaves undefined.

    The direction between two points that coincide (a clean pair under its true pose) is rounding
    noise; so is then their similarity, and the weight of that row. A rotation that its matches do
    not determine is compared by how well it fits them.
    """
    if not name.startswith("fine."):
        return normalised_error(actual[name], expected[name])
    index, part = int(name.split(".")[1]), name.split(".")[2]
    apart = kept_distances(actual, index) > COINCIDENT
    if part == "T" and determination(actual, index) < DETERMINED:
        return abs(gain(actual, index, expected[name]) - gain(actual, index, actual[name]))
    if part == "similarity":
        return normalised_error(actual[name][apart], expected[name][apart])
    if part == "match":  # the rows whose choice does not hang on noise
        rows = apart.all(1)
        return normalised_error(actual[name][rows], expected[name][rows])
    if part == "weight" and not apart.all():
        return 0.0
    return normalised_error(actual[name], expected[name])


def gain(stages: Stages, index: int, pose: np.ndarray) -> float:
    """What Procrustes maximises over rotations, trace(R^T H), for the step that `pose` takes.

    Relative to the largest gain that clouds of this size could have.
    """
    before = stages["coarse.T" if index == 0 else f"fine.{index - 1}.T"].astype(float)
    step = pose.astype(float)[:3, :3] @ before[:3, :3].T
    radii = [np.sqrt(np.square(cloud).sum(1).mean()) for cloud in kept_points(stages, index)]
    return float(np.trace(step.T @ covariance(stages, index)) / (radii[0] * radii[1]))
