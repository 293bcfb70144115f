"""Procrustes: exact recovery, weights, reflections, gradients."""

from __future__ import annotations

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vnreg_train.networks.coarse import procrustes


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(3, 40))
def test_recovers_a_known_pose(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    source = torch.from_numpy(rng.normal(size=(1, count, 3)))
    rotation = torch.from_numpy(Rotation.random(rng=rng).as_matrix())
    translation = torch.from_numpy(rng.normal(size=3))
    r, t = procrustes(source, source @ rotation.T + translation)
    assert torch.allclose(r[0], rotation, atol=1e-7)
    assert torch.allclose(t[0], translation, atol=1e-7)


def test_minimises_the_weighted_cost() -> None:
    """The stationary pose of the weighted cost, which unweighted centroids would miss."""
    rng = np.random.default_rng(3)
    x, y = (torch.from_numpy(rng.normal(size=(1, 30, 3))) for _ in range(2))
    w = torch.from_numpy(rng.uniform(0, 1, size=(1, 30)) ** 3)
    r, t = procrustes(x, y, w)

    def cost(rotation: torch.Tensor, translation: torch.Tensor) -> float:
        return float((w * (x @ rotation.T + translation - y).square().sum(-1)).sum())

    best = cost(r[0], t[0])
    for _ in range(200):
        step = torch.from_numpy(Rotation.from_rotvec(rng.normal(size=3) * 0.01).as_matrix())
        shift = torch.from_numpy(rng.normal(size=3) * 0.01)
        assert cost(step @ r[0], t[0] + shift) >= best - 1e-12


def test_a_mirrored_cloud_gets_a_rotation() -> None:
    x = torch.from_numpy(np.random.default_rng(0).normal(size=(1, 20, 3)))
    mirror = torch.diag(torch.tensor([-1.0, 1.0, 1.0], dtype=torch.float64))
    r, _ = procrustes(x, x @ mirror)
    assert torch.allclose(torch.det(r), torch.ones(1, dtype=torch.float64))


def test_gradient_agrees_with_differences() -> None:
    rng = np.random.default_rng(1)
    x, y = (torch.from_numpy(rng.normal(size=(2, 8, 3))).requires_grad_() for _ in range(2))
    assert torch.autograd.gradcheck(procrustes, (x, y))


def test_weights_that_are_all_zero_give_the_identity() -> None:
    x, y = torch.randn(1, 5, 3), torch.randn(1, 5, 3)
    r, t = procrustes(x, y, torch.zeros(1, 5))
    assert torch.allclose(r, torch.eye(3)) and torch.allclose(t, torch.zeros(1, 3))
