"""The symmetry group of a shape, found from its mesh and dense samples by one stated test.

A rotation g about an axis through the shape's middle belongs to the group if 99 % of the surface
lies within 0.01 of the turned surface, and the other way round (in longest sides). The samples are
turned, and their distances are those to the triangles, so that sampling does not count.

Candidates: the principal axes, the coordinate axes, and the edge and vertex directions of the
aligned cube, with the orders 2, 3, 4, 5, 6, 8, 12. Axis and centre are refined by a few
point-to-plane steps, within limits. An axis whose order-12 turn passes is continuous if all
multiples of 10 degrees pass. Of an axis the highest order that passes counts; the group is what
all axes generate.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import igl
import numpy as np
from scipy.spatial.transform import Rotation

from vnreg_train.data.mesh import Float64, Mesh
from vnreg_train.evaluate.symmetry import Axis, SymmetryGroup, make_group

LIMIT = 0.01
SHARE = 0.99
ORDERS = (12, 8, 6, 5, 4, 3, 2)
CONTINUOUS_STEP_DEG = 10
GLANCE_POINTS, GLANCE_LIMIT, GLANCE_SHARE = 400, 0.03, 0.9  # before the axis is refined
REFINE_POINTS, REFINE_STEPS = 3000, 8
MOST_TILT_DEG, MOST_SHIFT = 3.0, 0.03  # by the refinement
SAME_AXIS_DEG = 5.0


@dataclass(frozen=True)
class Turn:
    """The rotation by 360 / order degrees about an axis through a centre, unit direction (3,)."""

    direction: Float64
    centre: Float64

    def matrix(self, angle_deg: float) -> tuple[Float64, Float64]:
        """Rotation (3, 3) and translation (3,) of a turn by so much."""
        rotation = Rotation.from_rotvec(np.deg2rad(angle_deg) * self.direction).as_matrix()
        return rotation, self.centre - rotation @ self.centre


class Surface:
    """A mesh, and samples (N, 3) of its surface in random order."""

    def __init__(self, mesh: Mesh, samples: Float64, seed: int = 0) -> None:
        order = np.random.default_rng(seed).permutation(len(samples))
        self.points = np.asarray(samples, np.float64)[order]
        self._mesh = mesh
        self._tree = igl.AABB()
        self._tree.init(mesh.vertices, mesh.triangles)

    def nearest(self, points: Float64) -> tuple[Float64, Float64]:
        """Distances (N,) of points (N, 3) to the surface, and the nearest places on it (N, 3)."""
        squares, _, places = self._tree.squared_distance(
            self._mesh.vertices, self._mesh.triangles, points
        )
        return np.sqrt(squares), places

    def residual(self, rotation: Float64, translation: Float64, count: int | None = None) -> float:
        """The distance that SHARE of the first `count` points keep to, the worse of both ways."""
        there = self.points[:count] @ rotation.T + translation
        back = (self.points[:count] - translation) @ rotation
        return max(float(np.quantile(self.nearest(p)[0], SHARE)) for p in (there, back))

    def glance(self, rotation: Float64, translation: Float64) -> bool:
        """Whether a few points leave it possible that the turned surface is the same."""
        there = self.points[:GLANCE_POINTS] @ rotation.T + translation
        return bool((self.nearest(there)[0] < GLANCE_LIMIT).mean() > GLANCE_SHARE)

    def refined(self, rotation: Float64, translation: Float64) -> tuple[Float64, Float64]:
        """Point-to-plane steps towards the rigid motion that maps the surface onto itself."""
        for _ in range(REFINE_STEPS):
            moved = self.points[:REFINE_POINTS] @ rotation.T + translation
            error, places = self.nearest(moved)
            near = (error > 1e-9) & (error < GLANCE_LIMIT)
            if not near.any():
                break
            moved, error = moved[near], error[near]
            normals = (moved - places[near]) / error[:, None]
            weight = 1 / (1 + (error / LIMIT) ** 2)
            rows = np.hstack([np.cross(moved, normals), normals])
            # The points that already lie on the surface hold the motion where it is.
            hold = 1e-6 * len(rows) + 0.1 * (len(near) - len(rows))
            normal_matrix = rows.T @ (rows * weight[:, None]) + hold * np.eye(6)
            step = np.linalg.solve(normal_matrix, -rows.T @ (weight * error))
            turn = Rotation.from_rotvec(step[:3]).as_matrix()
            rotation, translation = turn @ rotation, turn @ translation + step[3:]
        return rotation, translation


def find_symmetry(mesh: Mesh, samples: Float64, seed: int = 0) -> SymmetryGroup:
    """The group of a shape of longest side 1, from dense samples (N, 3) of its surface."""
    surface = Surface(mesh, samples, seed)
    middle = surface.points.mean(0)
    axes: list[tuple[Turn, Axis]] = []
    for direction in candidate_directions(surface.points):
        if any(_same_axis(direction, turn.direction) for turn, _ in axes):
            continue
        found = _axis(surface, Turn(direction, middle))
        if found and not any(_same_axis(found[0].direction, turn.direction) for turn, _ in axes):
            axes.append(found)
    turns = [turn for turn, _ in axes]
    return make_group(common_centre(turns, middle), [axis for _, axis in axes])


def candidate_directions(points: Float64) -> Iterator[Float64]:
    """Unit directions (3,): of the cube's faces, edges and vertices; the principal axes."""
    for vector in itertools.product((-1, 0, 1), repeat=3):
        if vector > (0, 0, 0):
            yield np.array(vector) / np.linalg.norm(vector)
    yield from np.linalg.eigh(np.cov(points.T))[1].T


def common_centre(turns: list[Turn], middle: Float64) -> Float64:
    """The point (3,) nearest to all axes; along a single one it is the middle's foot."""
    matrix, right = 1e-6 * np.eye(3), 1e-6 * middle
    for turn in turns:
        across = np.eye(3) - np.outer(turn.direction, turn.direction)
        matrix, right = matrix + across, right + across @ turn.centre
    return np.asarray(np.linalg.solve(matrix, right))


def _axis(surface: Surface, turn: Turn) -> tuple[Turn, Axis] | None:
    """The highest order of an axis near `turn`, with the axis refined; None for none."""
    for order in ORDERS:
        if not surface.glance(*turn.matrix(360 / order)):
            continue
        refined = _refined(surface, turn, 360 / order)
        if refined is None:
            continue
        residual = surface.residual(*refined.matrix(360 / order), GLANCE_POINTS)
        if residual < 2 * LIMIT:
            residual = surface.residual(*refined.matrix(360 / order))
        if residual > LIMIT:
            continue
        if order == ORDERS[0]:
            full = continuous_residual(surface, refined)
            if full <= LIMIT:
                return refined, Axis(_triple(refined.direction), 0, full)
        return refined, Axis(_triple(refined.direction), order, residual)
    return None


def continuous_residual(surface: Surface, turn: Turn) -> float:
    """The worst over all multiples of CONTINUOUS_STEP_DEG; stops at the first that fails."""
    worst = 0.0
    for angle in range(CONTINUOUS_STEP_DEG, 181, CONTINUOUS_STEP_DEG):
        worst = max(worst, surface.residual(*turn.matrix(angle)))
        if worst > LIMIT:
            break
    return worst


def _refined(surface: Surface, turn: Turn, angle_deg: float) -> Turn | None:
    """Axis and centre that fit best near `turn`; None where that is elsewhere."""
    rotation, translation = surface.refined(*turn.matrix(angle_deg))
    vector = Rotation.from_matrix(rotation).as_rotvec()
    direction = vector / np.linalg.norm(vector)
    if direction @ turn.direction < 0:
        direction = -direction
    # Of a rotation about an axis through c the translation is (I - R) c.
    centre = (
        turn.centre
        + np.linalg.lstsq(
            np.eye(3) - rotation, translation - turn.centre + rotation @ turn.centre, rcond=1e-6
        )[0]
    )
    shift = np.linalg.norm(centre - turn.centre)
    if not _same_axis(direction, turn.direction, MOST_TILT_DEG) or shift > MOST_SHIFT:
        return None
    return Turn(direction, centre)


def _same_axis(a: Float64, b: Float64, limit_deg: float = SAME_AXIS_DEG) -> bool:
    return bool(abs(a @ b) > np.cos(np.deg2rad(limit_deg)))


def _triple(direction: Float64) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 6) for value in direction)
    return x, y, z
