"""The network `vnreg`: moments by their definition, and its exact properties."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from vnreg_train.networks.descriptor import DescriptorNetwork, Features, input_features
from vnreg_train.networks.descriptor_config import DescriptorConfig
from vnreg_train.networks.moments import determinant, radius_moments

RADII = DescriptorConfig().moment_radii


def cloud(count: int, seed: int = 0) -> Tensor:
    points = np.random.default_rng(seed).normal(size=(1, count, 3)) * [1.0, 0.6, 0.2]
    return torch.from_numpy(points - points.mean(1, keepdims=True))


def network() -> DescriptorNetwork:
    torch.manual_seed(1)
    return DescriptorNetwork(DescriptorConfig(channels=8, scalars=12)).double().eval()


def described(model: DescriptorNetwork, points: Tensor, encoded: int) -> Features:
    with torch.no_grad():
        inputs = input_features(points, torch.ones_like(points[..., 0]), encoded, RADII)
        return model(points[:, :encoded], inputs)


@pytest.mark.parametrize("radius", [0.05, 0.5, 4.0])
def test_moments_equal_their_definition(radius: float) -> None:
    points = cloud(60)
    mask = torch.ones(1, 60, dtype=torch.float64)
    mask[:, 50:] = 0
    offset, covariance, skew = radius_moments(points, mask, points[:, :20], radius)
    for i in range(20):
        delta = (points[0, :50] - points[0, i]).numpy()
        squared = (delta**2).sum(1)
        weight = np.clip(1 - squared / radius**2, 0, None) ** 2
        weight /= weight.sum()
        o = weight @ delta / radius
        c = 4 * (delta.T * weight @ delta / radius**2 - np.outer(o, o))
        np.testing.assert_allclose(offset[0, i], o, atol=1e-10)
        np.testing.assert_allclose(covariance[0, i], c, atol=1e-9)
        np.testing.assert_allclose(skew[0, i], weight * squared @ delta / radius**3, atol=1e-9)


def test_determinants_are_those_of_numpy() -> None:
    factors = torch.randn(10, 3, 3, dtype=torch.float64)
    symmetric = factors + factors.transpose(1, 2)
    np.testing.assert_allclose(determinant(symmetric), np.linalg.det(symmetric.numpy()))


def test_padding_and_order_change_nothing() -> None:
    model, points = network(), cloud(70)
    padded = torch.cat([points, torch.zeros(1, 9, 3, dtype=torch.float64)], 1)
    mask = torch.cat([torch.ones(1, 70), torch.zeros(1, 9)], 1).double()
    order = torch.cat([torch.arange(40), 40 + torch.randperm(30)])
    plain = described(model, points, 40)
    with torch.no_grad():
        masked = model(points[:, :40], input_features(padded, mask, 40, RADII))
    shuffled = described(model, points[:, order], 40)
    for a, b, c in zip(plain, masked, shuffled, strict=True):
        torch.testing.assert_close(a, b, rtol=0, atol=1e-9)
        torch.testing.assert_close(a, c, rtol=0, atol=1e-9)


def test_vectors_turn_and_numbers_stay() -> None:
    model, points = network(), cloud(80)
    turn = torch.from_numpy(Rotation.random(rng=np.random.default_rng(2)).as_matrix())
    plain, turned = described(model, points, 50), described(model, points @ turn.T, 50)
    for name in ("local", "context", "significance", "overlap"):
        torch.testing.assert_close(getattr(turned, name), getattr(plain, name))
    for name in ("frames_local", "frames_context", "global_feature"):
        torch.testing.assert_close(getattr(turned, name), turn @ getattr(plain, name))


def test_a_mirror_image_is_another_shape() -> None:
    """The network is equivariant to rotations, not to reflections: it can tell left from right."""
    model, points = network(), cloud(80)
    mirror = torch.diag(torch.tensor([-1.0, 1.0, 1.0], dtype=torch.float64))
    plain, mirrored = described(model, points, 50), described(model, points @ mirror, 50)
    assert (plain.local - mirrored.local).norm() > 1e-3 * plain.local.norm()


def test_descriptors_have_the_learned_length_and_frames_unit_size() -> None:
    features = described(network(), cloud(50), 30)
    length = torch.full((1, 30), float(np.exp(2.3 / 2)), dtype=torch.float64)
    torch.testing.assert_close(features.local.norm(dim=2), length, rtol=1e-6, atol=0)
    sizes = features.frames_local.square().sum((2, 3))
    torch.testing.assert_close(sizes, torch.ones_like(sizes))


def test_fitted_inputs_have_unit_size() -> None:
    model = network()
    points = cloud(90)
    inputs = input_features(points, torch.ones_like(points[..., 0]), 60, RADII)
    model.fit_inputs(inputs)
    size = (inputs.local * model.local_scale).square().sum(2).mean((0, 1)).sqrt()
    torch.testing.assert_close(size, torch.ones_like(size))
    scalars = (inputs.scalars - model.scalar_mean) * model.scalar_scale
    torch.testing.assert_close(scalars.std((0, 1)), torch.ones(18, dtype=torch.float64))


def test_unknown_keys_are_named() -> None:
    with pytest.raises(ValueError, match="widths"):
        DescriptorConfig.from_dict({"widths": 3})
