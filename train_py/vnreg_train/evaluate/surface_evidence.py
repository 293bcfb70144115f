"""How clearly a wrong pose is wrong to one who knows the surface: an oracle for what can be told.

Two poses that no registration of two sparse, noisy clouds tells apart may still be told apart by
the target's points and the shape's exact surface. Where not even those tell, the pair is truly
ambiguous: noise hides the detail, or the crop has taken it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from vnreg_train.data.mesh import Float32, Float64

TOLD = float(np.log(20.0))  # nats: twenty to one
PLANE_SAMPLES = 9
# Of a point off its plane, longest sides: the least that is believed, and what refinement counts as
# on the surface.
LEAST_SPREAD, NEAR = 0.003, 0.01
SETTLING_STEPS = 20
ASTRAY = 0.1  # share of points that may be anywhere, within one longest side


class Surface:
    """Dense samples (N, 3) of a shape with the planes through their neighbours."""

    def __init__(self, samples: Float32) -> None:
        self._samples = samples.astype(np.float64)
        self._tree = cKDTree(self._samples)
        near = self._samples[self._tree.query(self._samples, PLANE_SAMPLES)[1]]
        near -= near.mean(axis=1, keepdims=True)
        self._normals = np.linalg.eigh(near.transpose(0, 2, 1) @ near)[1][:, :, 0]

    def offsets(self, points: Float64) -> Float64:
        """Distances (M,), with sign, of points (M, 3) from the plane at the nearest sample."""
        return self._offsets_and_normals(points)[0]

    def settled(self, points: Float64) -> Float64:
        """The points (M, 3) after the small rigid motion that lays them on the surface best.

        Gauss-Newton steps on the distances from the planes, with the weights of Cauchy's loss.
        """
        for _ in range(SETTLING_STEPS):
            middle = points.mean(axis=0)
            offsets, normals = self._offsets_and_normals(points)
            slopes = np.hstack([np.cross(points - middle, normals), normals])
            weighted = slopes / (1 + (offsets / NEAR) ** 2)[:, None]
            # What no plane holds stays where it is.
            curvature = weighted.T @ slopes + 1e-6 * len(points) * np.eye(6)
            motion = np.linalg.solve(curvature, -weighted.T @ offsets)
            turn = Rotation.from_rotvec(motion[:3]).as_matrix()
            points = (points - middle) @ turn.T + middle + motion[3:]
        return points

    def _offsets_and_normals(self, points: Float64) -> tuple[Float64, Float64]:
        nearest = self._tree.query(points)[1]
        normals = self._normals[nearest]
        return ((points - self._samples[nearest]) * normals).sum(axis=1), normals


def evidence(surface: Surface, target: Float32, truth: Float64, estimate: Float64) -> float:
    """Log-likelihood ratio, nats, for the right pose (4, 4) against a wrong one; below 0: the wrong
    one fits the surface better.

    Of the target's points (M, 3) alone, since the source's tell nothing to one who knows the
    surface. Both poses may settle first, so that only what refinement cannot mend counts. Points
    are Gaussian off the surface, as widely as they are under the right pose, or anywhere.
    """
    right, wrong = (
        surface.offsets(surface.settled(_in_source_frame(target, pose)))
        for pose in (truth, estimate)
    )
    inner = np.abs(right)[np.abs(right) <= np.quantile(np.abs(right), 1 - ASTRAY)]
    spread = max(float(np.sqrt(np.mean(inner**2))), LEAST_SPREAD)
    return _log_likelihood(right, spread) - _log_likelihood(wrong, spread)


def _in_source_frame(target: Float32, pose: Float64) -> Float64:
    return np.asarray((target.astype(np.float64) - pose[:3, 3]) @ pose[:3, :3])


def _log_likelihood(offsets: Float64, spread: float) -> float:
    density = np.exp(-0.5 * (offsets / spread) ** 2) / (spread * np.sqrt(2 * np.pi))
    return float(np.log((1 - ASTRAY) * density + ASTRAY).sum())
