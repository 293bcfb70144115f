"""Mode verified from Python: covariance and evidence, and whether the covariance is true."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import vnreg

Array = NDArray[np.float64]
EVIDENCE = [
    "score",
    "margin",
    "covered",
    "contradicted",
    "beyond",
    "residual",
    "noise",
    "certainty",
]


def lopsided_body(rng: np.random.Generator, count: int = 1024) -> Array:
    """(count, 3) points on a closed surface without symmetry, r.m.s. radius about 0.4."""
    v = rng.normal(size=(count, 3))
    x, y, z = (v / np.linalg.norm(v, axis=1, keepdims=True)).T
    bump = 1 + 0.4 * x * y + 0.3 * z**3 + 0.2 * x
    return np.stack([0.5 * bump * x, 0.35 * bump * y, 0.25 * bump * z], axis=1)


def test_shapes_types_and_copies(model: vnreg.Model, pair: Any) -> None:
    result = vnreg.align(pair.source, pair.target, model=model)
    covariance = result.covariance
    assert covariance.shape == (6, 6) and covariance.dtype == np.float64
    assert np.isfinite(covariance).all()
    np.testing.assert_array_equal(covariance, covariance.T)
    covariance[:] = 0
    assert result.covariance.any()
    assert list(result.evidence) == EVIDENCE
    assert all(isinstance(value, float) for value in result.evidence.values())
    assert result.evidence["score"] == result.score


@pytest.mark.parametrize("mode", ["coarse", "paper"])
def test_the_other_modes_do_not_know(mode: Any, model: vnreg.Model, pair: Any) -> None:
    result = vnreg.align(pair.source, pair.target, model=model, mode=mode)
    assert result.has_pose
    assert np.isnan(result.covariance).all() and result.covariance.shape == (6, 6)
    assert result.evidence == {}


def test_without_a_pose_nothing_is_known(model: vnreg.Model, pair: Any) -> None:
    result = vnreg.align(pair.source[:5], pair.target, model=model)
    assert np.isnan(result.covariance).all()
    assert result.evidence == {}


def normalised_errors(pairs: int, noise: float, seed: int) -> Array:
    """e^T C^-1 e of every pose that is right, of samples of their own of one body."""
    rng = np.random.default_rng(seed)
    registrar = vnreg.Registrar()
    errors = []
    for _ in range(pairs):
        turn, shift = Rotation.random(random_state=rng), rng.uniform(-2, 2, 3)
        source = lopsided_body(rng) + noise * rng.normal(size=(1024, 3))
        target = turn.apply(lopsided_body(rng)) + shift + noise * rng.normal(size=(1024, 3))
        result = registrar.align(source, target)
        estimate = Rotation.from_matrix(result.T_target_source[:3, :3])
        missing = turn * estimate.inv()
        error = np.concatenate(
            [missing.as_rotvec(), shift - missing.apply(result.T_target_source[:3, 3])]
        )
        if missing.magnitude() < np.radians(5):
            errors.append(error @ np.linalg.solve(result.covariance, error))
    return np.array(errors)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_errors_are_as_large_as_the_covariance_says(noise: float) -> None:
    """The mean is 6 where the covariance is true; within a factor of 3 for a body unlike the
    furniture that its constants were measured on."""
    errors = normalised_errors(40, noise, seed=4)
    assert len(errors) >= 36
    assert 2 < errors.mean() < 18
    assert (errors < 40).mean() > 0.9
