"""The losses' definitions on inputs whose value is known."""

from __future__ import annotations

import math

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from vnreg_train.training.losses import (
    consistency_loss,
    limit_gradient,
    occupancy_loss,
    registration_loss,
)


def test_registration_loss_is_the_chord_of_the_angle() -> None:
    """|R - I|_F² = 8 sin²(angle / 2)."""
    rotation = torch.from_numpy(Rotation.from_rotvec([0.0, 0.0, 0.6]).as_matrix())[None]
    shift = torch.tensor([[0.1, 0.0, 0.2]], dtype=torch.float64)
    loss = registration_loss(rotation, shift)
    assert math.isclose(float(loss), 8 * math.sin(0.3) ** 2 + 0.05, rel_tol=1e-12)


def test_occupancy_loss_does_not_depend_on_the_number_of_queries() -> None:
    logits, labels = torch.randn(3, 64), torch.randint(0, 2, (3, 64)).float()
    once = occupancy_loss(logits, labels)
    twice = occupancy_loss(logits.repeat(1, 2), labels.repeat(1, 2))
    assert torch.isclose(once, twice)
    assert torch.isclose(
        occupancy_loss(torch.zeros(1, 8), torch.ones(1, 8)), torch.tensor(2048 * math.log(2))
    )


def test_consistency_is_zero_for_equal_features_and_blind_to_scale_and_rotation() -> None:
    rng = np.random.default_rng(0)
    a, b = (torch.from_numpy(rng.normal(size=(2, 3, 16))) for _ in range(2))
    assert float(consistency_loss(a, a + 3.0)) < 1e-20
    rotation = torch.from_numpy(Rotation.random(rng=rng).as_matrix())
    turned = consistency_loss(5 * rotation @ a, 5 * rotation @ b)
    assert torch.isclose(turned, consistency_loss(a, b), rtol=1e-9)
    assert 0 < float(turned) < 4


def test_limited_gradient_keeps_direction_and_small_gradients() -> None:
    vectors = torch.randn(2, 3, 8, dtype=torch.float64, requires_grad=True)
    weight = torch.randn(2, 3, 8, dtype=torch.float64)
    weight[0] *= 1e6
    (limit_gradient(vectors, 50.0) * weight).sum().backward()
    assert vectors.grad is not None
    assert torch.allclose(vectors.grad[1], weight[1])
    ratio = vectors.grad[0] / weight[0]
    assert torch.allclose(ratio, ratio[0, 0].expand_as(ratio))
    spread = (vectors[0] - vectors[0].mean(1, keepdim=True)).square().sum(0).mean().sqrt()
    assert math.isclose(float(vectors.grad[0].norm() * spread), 50.0, rel_tol=1e-9)


def test_without_a_limit_the_gradient_is_untouched() -> None:
    vectors = torch.randn(1, 3, 4, requires_grad=True)
    assert limit_gradient(vectors, 0.0) is vectors
