"""Evaluation pairs of the paper (section IV) and the errors they are judged by.

Two protocols. `P0` is what the paper authors' code does; `text` is what the paper's words say:

| setting     | P0                                        | text                                |
|-------------|-------------------------------------------|-------------------------------------|
| clean       | the same 1,024 points                     | the same                            |
| noisy       | the same 1,024 points, then noise         | the same                            |
| independent | 2 x 1,024 of one fixed set of 2,048, so   | 2 x 1,024 different points          |
|             | that about 512 coincide                   |                                     |
| partial     | the 768 of 1,024 points nearest to a far  | the 768 of 1,024 points furthest    |
|             | viewpoint near +-(1, 1, 1), before the    | along a direction uniform on the    |
|             | rotation                                  | sphere                              |

In partial both clouds start from the same 1,024 points and are cropped independently. The paper
calls the crop "farthest point sampling" and says that it follows RPMNet; RPMNet cuts with a
plane of random direction that leaves a given share of the points, which is how `text` reads it.
Noise is N(0, 0.01) per coordinate clipped to +-0.05, drawn for both clouds, after the motion.
Beyond the paper's settings, `partial_independent` and `partial_independent_noisy` combine them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vnreg_train.data.catalog import stable_seed
from vnreg_train.data.mesh import Float32, Float64
from vnreg_train.data.shapes import ShapeSet

POINTS = 1024
FIXED_SET = 2048
KEPT_SHARE = 0.75
FAR = 500.0
NOISE_SIGMA = 0.01
NOISE_CLIP = 0.05
MAX_TRANSLATION = 0.5
ANGLES_DEG = (45, 90, 135, 180)
PROTOCOLS = ("P0", "text")


@dataclass(frozen=True)
class Setting:
    """How the two clouds of a pair differ, beside their pose and order."""

    independent: bool = False
    partial: bool = False
    noisy: bool = False


SETTINGS = {
    "clean": Setting(),
    "noisy": Setting(noisy=True),
    "independent": Setting(independent=True),
    "partial": Setting(partial=True),
    "partial_independent": Setting(independent=True, partial=True),
    "partial_independent_noisy": Setting(independent=True, partial=True, noisy=True),
}


@dataclass(frozen=True)
class Pair:
    """Two clouds of one shape and the true pose between them: y = R x + t.

    source: (N, 3) float32, target: (M, 3) float32, in units of the shape's longest side, in
    random order. T_target_source: (4, 4) float64. same_crop: P0 partial only, whether both were
    cropped towards the same side, else None. overlap: share of the source's points that the
    target's crop keeps as well (1 where nothing is cropped).
    """

    source: Float32
    target: Float32
    T_target_source: Float64
    shape: int
    name: str
    setting: str
    max_angle_deg: float
    same_crop: bool | None
    overlap: float


@dataclass(frozen=True)
class _Crop:
    """Keeps the points nearest to a viewpoint in a direction (3,), perhaps infinitely far.

    curvature: 1 / (2 x its distance). sign: of (1, 1, 1) in the direction, if it is along that.
    """

    direction: Float64
    curvature: float = 0.0
    sign: int | None = None

    def distances(self, points: Float64) -> Float64:
        """Numbers (N,) in the order of the points' distances from the viewpoint."""
        squares = (points**2).sum(axis=1)
        return np.asarray(self.curvature * squares - points @ self.direction)


def make_pair(
    shapes: ShapeSet,
    index: int,
    setting: str,
    max_angle_deg: float,
    protocol: str = "P0",
    seed: int = 0,
) -> Pair:
    """The evaluation pair of one shape: a pure function of the arguments, bit for bit.

    Angles are Euler angles U[0, max_angle_deg] each, R = Rx Ry Rz; translation U[-0.5, 0.5]^3.
    Shapes need 2,048 surface points or more. Raises ValueError for unknown names.
    """
    if setting not in SETTINGS:
        raise ValueError(f"setting must be one of {', '.join(SETTINGS)}, got {setting!r}")
    if protocol not in PROTOCOLS:
        raise ValueError(f"protocol must be one of {', '.join(PROTOCOLS)}, got {protocol!r}")
    if not 0 <= index < len(shapes):
        raise ValueError(f"shape index {index} is outside 0..{len(shapes) - 1}")
    what = SETTINGS[setting]
    angle = f"{float(max_angle_deg):.6f}"
    rng = np.random.default_rng(stable_seed("pair", seed, protocol, setting, angle, index))
    source, target = _points(shapes, index, what, protocol, seed, rng)
    pose = random_pose(rng, max_angle_deg)
    same_crop: bool | None = None
    overlap = 1.0
    if what.partial:
        crops = [_random_crop(rng, protocol) for _ in range(2)]
        source, target, overlap = _cropped(source, target, crops)
        if protocol == "P0":
            same_crop = crops[0].sign == crops[1].sign
    target = target @ pose[:3, :3].T + pose[:3, 3]
    if what.noisy:
        source, target = source + _noise(rng, len(source)), target + _noise(rng, len(target))
    return Pair(
        source=rng.permutation(source).astype(np.float32),
        target=rng.permutation(target).astype(np.float32),
        T_target_source=pose,
        shape=index,
        name=shapes.names[index],
        setting=setting,
        max_angle_deg=float(max_angle_deg),
        same_crop=same_crop,
        overlap=overlap,
    )


def pairs(
    shapes: ShapeSet,
    setting: str,
    max_angle_deg: float,
    protocol: str = "P0",
    seed: int = 0,
    indices: Sequence[int] | None = None,
) -> Iterator[Pair]:
    """One pair per shape (of `indices`, default all). See make_pair."""
    for index in range(len(shapes)) if indices is None else indices:
        yield make_pair(shapes, index, setting, max_angle_deg, protocol, seed)


def _points(
    shapes: ShapeSet, index: int, what: Setting, protocol: str, seed: int, rng: np.random.Generator
) -> tuple[Float64, Float64]:
    """Source and target points (1024, 3) each, in the object's frame.

    The fixed set of a shape is the same for every setting and angle of one seed.
    """
    surface = shapes.surface[index]
    if len(surface) < FIXED_SET:
        raise ValueError(f"pairs need {FIXED_SET} points per shape, there are {len(surface)}")
    fixed_rng = np.random.default_rng(stable_seed("fixed set", seed, index))
    chosen = fixed_rng.choice(len(surface), FIXED_SET, replace=False)
    fixed = surface[chosen].astype(np.float64)
    if not what.independent:
        return fixed[:POINTS], fixed[:POINTS]
    if protocol == "P0":
        return fixed[:POINTS], rng.permutation(fixed)[:POINTS]
    return fixed[:POINTS], fixed[POINTS:]


def _random_crop(rng: np.random.Generator, protocol: str) -> _Crop:
    if protocol == "text":
        return _Crop(random_direction(rng))
    sign = int(rng.choice([-1, 1]))
    viewpoint = rng.random(3) + sign * FAR
    distance = float(np.linalg.norm(viewpoint))
    return _Crop(viewpoint / distance, 1 / (2 * distance), sign)


def _cropped(
    source: Float64, target: Float64, crops: Sequence[_Crop]
) -> tuple[Float64, Float64, float]:
    """Both clouds cropped, and the share of the kept source that the target's crop keeps."""
    kept = int(KEPT_SHARE * len(source))
    source_order, target_order = crops[0].distances(source), crops[1].distances(target)
    chosen = source[np.argsort(source_order, kind="stable")[:kept]]
    limit = np.partition(target_order, kept - 1)[kept - 1]
    overlap = float((crops[1].distances(chosen) <= limit).mean())
    return chosen, target[np.argsort(target_order, kind="stable")[:kept]], overlap


def _noise(rng: np.random.Generator, count: int) -> Float64:
    return np.clip(rng.normal(0.0, NOISE_SIGMA, (count, 3)), -NOISE_CLIP, NOISE_CLIP)


def random_direction(rng: np.random.Generator) -> Float64:
    """A direction (3,) uniform on the sphere."""
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))


def random_pose(rng: np.random.Generator, max_angle_deg: float) -> Float64:
    """A pose (4, 4): Euler angles U[0, max_angle_deg] each, translation U[-0.5, 0.5]^3."""
    pose = np.eye(4)
    pose[:3, :3] = euler_rotation(np.deg2rad(rng.uniform(0.0, max_angle_deg, 3)))
    pose[:3, 3] = rng.uniform(-MAX_TRANSLATION, MAX_TRANSLATION, 3)
    return pose


def euler_rotation(angles: ArrayLike) -> Float64:
    """R = Rx Ry Rz (3, 3) of three angles in radians."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_x @ about_y @ about_z)


def rotation_error_deg(pose_a: ArrayLike, pose_b: ArrayLike) -> NDArray[np.float64]:
    """Angle in degrees between the rotations of poses (..., 4, 4) or rotations (..., 3, 3).

    From sine and cosine together, so accurate near 0 and near 180 degrees.
    """
    a, b = np.asarray(pose_a, np.float64)[..., :3, :3], np.asarray(pose_b, np.float64)[..., :3, :3]
    turn = np.swapaxes(a, -1, -2) @ b
    skew = (turn - np.swapaxes(turn, -1, -2)) / 2
    sine = np.sqrt((skew**2).sum(axis=(-1, -2)) / 2)
    cosine = (np.trace(turn, axis1=-2, axis2=-1) - 1) / 2
    return np.asarray(np.rad2deg(np.arctan2(sine, cosine)))


def translation_error(pose_a: ArrayLike, pose_b: ArrayLike) -> NDArray[np.float64]:
    """Distance between the translations of poses (..., 4, 4), in the clouds' unit."""
    a, b = np.asarray(pose_a, np.float64)[..., :3, 3], np.asarray(pose_b, np.float64)[..., :3, 3]
    return np.asarray(np.linalg.norm(a - b, axis=-1))


def recall(
    rotation_deg: ArrayLike,
    translation: ArrayLike,
    max_rotation_deg: float = 5.0,
    max_translation: float = 0.2,
) -> float:
    """Share (0 to 1) of pairs whose both errors are below the limits; NaN is a miss."""
    rotations: NDArray[Any] = np.asarray(rotation_deg, np.float64)
    translations: NDArray[Any] = np.asarray(translation, np.float64)
    if rotations.shape != translations.shape or rotations.size == 0:
        raise ValueError(f"errors of shapes {rotations.shape} and {translations.shape}")
    return float(((rotations < max_rotation_deg) & (translations < max_translation)).mean())
