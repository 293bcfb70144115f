"""Rotations that leave a shape as it is, and pose errors that do not count them.

A pose T_target_source and T_target_source · g place a shape alike for every g of its group; so
the error of an estimate is the least one over g.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from vnreg_train.data.mesh import Float64
from vnreg_train.data.protocol import rotation_error_deg, translation_error

SYMMETRIES = Path("data/symmetries/furniture.json")
SAME_ROTATION_DEG = 4.0
MOST_ELEMENTS = 120  # of a finite group: an order-60 dihedral or the icosahedral group


@dataclass(frozen=True)
class Axis:
    """A rotation axis of a shape. order: 2, 3, ..., or 0 where every angle will do.

    residual: the distance that 99 % of the surface keep to, longest sides of the shape.
    """

    direction: tuple[float, float, float]
    order: int
    residual: float


@dataclass(frozen=True)
class SymmetryGroup:
    """The group that the axes, all through `centre`, generate (in the object's frame).

    elements: (G, 3, 3) rotations: all of a finite group; of one with a continuous axis those
    that map the axis onto itself, up to turns about it. axis: (3,) the continuous one or None.
    sphere: whether every rotation belongs to it.
    """

    centre: Float64
    elements: Float64
    axis: Float64 | None = None
    sphere: bool = False
    axes: tuple[Axis, ...] = field(default=())

    @property
    def trivial(self) -> bool:
        return len(self.elements) == 1 and self.axis is None and not self.sphere

    def nearest(self, estimate: ArrayLike, truth: ArrayLike) -> Float64:
        """The pose truth · g (4, 4) whose rotation is nearest to that of the estimate (4, 4)."""
        T_estimate, T_truth = np.asarray(estimate, np.float64), np.asarray(truth, np.float64)
        turns = self._turns(T_truth[:3, :3].T @ T_estimate[:3, :3])
        nearest = turns[np.argmin(rotation_error_deg(T_truth[:3, :3] @ turns, T_estimate[:3, :3]))]
        move = np.eye(4)
        move[:3, :3], move[:3, 3] = nearest, self.centre - nearest @ self.centre
        return np.asarray(T_truth @ move)

    def errors(self, estimate: ArrayLike, truth: ArrayLike) -> tuple[float, float]:
        """Rotation (degrees) and translation error of a pose, to the nearest right one."""
        nearest = self.nearest(estimate, truth)
        return (
            float(rotation_error_deg(estimate, nearest)),
            float(translation_error(estimate, nearest)),
        )

    def _turns(self, wanted: Float64) -> Float64:
        """Elements (G, 3, 3), turned about the continuous axis to be nearest to `wanted`."""
        if self.sphere:
            return wanted[None]
        if self.axis is None:
            return self.elements
        return np.stack([e @ best_turn(self.axis, e.T @ wanted) for e in self.elements])


TRIVIAL = SymmetryGroup(np.zeros(3), np.eye(3)[None])


def best_turn(axis: Float64, wanted: Float64) -> Float64:
    """The rotation (3, 3) about a unit axis that is nearest to the rotation `wanted` (3, 3).

    trace(wanted^T Rot(axis, a)) = constant + cos(a) C + sin(a) S is largest at atan2(S, C).
    """
    cosine = np.trace(wanted) - axis @ wanted @ axis
    skew = np.array(
        [wanted[2, 1] - wanted[1, 2], wanted[0, 2] - wanted[2, 0], wanted[1, 0] - wanted[0, 1]]
    )
    return np.asarray(Rotation.from_rotvec(np.arctan2(skew @ axis, cosine) * axis).as_matrix())


def make_group(centre: ArrayLike, axes: Sequence[Axis]) -> SymmetryGroup:
    """The group that the axes generate. Raises ValueError where it has too many elements."""
    directions = np.array([axis.direction for axis in axes], np.float64).reshape(-1, 3)
    continuous = [d for d, axis in zip(directions, axes, strict=True) if axis.order == 0]
    middle = np.asarray(centre, np.float64)
    if any(abs(continuous[0] @ other) < 0.99 for other in continuous[1:]):
        return SymmetryGroup(middle, np.eye(3)[None], None, True, tuple(axes))
    if not continuous:
        elements = closure([_turn(d, a.order) for d, a in zip(directions, axes, strict=True)])
        return SymmetryGroup(middle, elements, None, False, tuple(axes))
    # Beside turns about a continuous axis only half-turns across it can leave a shape as it is.
    across = [d for d in directions if abs(d @ continuous[0]) < 0.1]
    flips = [_turn(d - (d @ continuous[0]) * continuous[0], 2) for d in across[:1]]
    elements = np.stack([np.eye(3), *flips])
    return SymmetryGroup(middle, elements, continuous[0], False, tuple(axes))


def _turn(direction: Float64, order: int) -> Float64:
    unit = direction / np.linalg.norm(direction)
    return np.asarray(Rotation.from_rotvec(2 * np.pi / order * unit).as_matrix())


def closure(generators: Sequence[Float64]) -> Float64:
    """All products (G, 3, 3) of rotations (3, 3), the identity first.

    Rotations within SAME_ROTATION_DEG are one. Raises ValueError beyond MOST_ELEMENTS.
    """
    elements = [np.eye(3)]
    for element in elements:  # grows while it is read
        for generator in generators:
            product = element @ generator
            if rotation_error_deg(np.stack(elements), product).min() > SAME_ROTATION_DEG:
                elements.append(product)
        if len(elements) > MOST_ELEMENTS:
            raise ValueError(f"the rotations generate more than {MOST_ELEMENTS} elements")
    return np.stack(elements)


def read_symmetries(path: Path = SYMMETRIES) -> dict[str, SymmetryGroup]:
    """Groups by shape name; shapes without any symmetry are listed with no axes."""
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    groups = {}
    for name, shape in content["shapes"].items():
        axes = [
            Axis(tuple(a["axis"]), 0 if a["order"] == "continuous" else a["order"], a["residual"])
            for a in shape["axes"]
        ]
        groups[name] = make_group(shape["centre"], axes)
    return groups
