"""The encoder's exact properties, and what the ablations give up."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.edges import (
    edge_vectors,
    neighbour_mean,
    neighbour_mean_kdtree,
)
from vnreg_train.networks.encoder import FeatureExtractor
from vnreg_train.training.initial import scale_initial_weights

SMALL = NetworkConfig(global_channels=8, local_channels=8, descriptor_channels=12, neighbours=6)


def cloud(points: int, seed: int) -> torch.Tensor:
    points_np = np.random.default_rng(seed).normal(size=(1, points, 3)) * [0.5, 0.3, 0.2]
    return torch.from_numpy(points_np - points_np.mean(1, keepdims=True))


def extractor(config: NetworkConfig, seed: int = 0) -> FeatureExtractor:
    """A network whose every layer matters: features of unit size, statistics not trivial."""
    torch.manual_seed(seed)
    module = FeatureExtractor(config).double()
    points = torch.cat([cloud(64, s) for s in range(4)])
    edges = edge_vectors(points, neighbour_mean(points, config.neighbours))
    if config.vector_neurons:
        scale_initial_weights(module, edges)
    for part in module.modules():
        if isinstance(part, torch.nn.BatchNorm1d):
            part.momentum = 1.0  # take over the statistics of the one batch that follows
    latent, feature = module.train().global_module(edges)
    module.describe(edges, latent, feature)
    return module.eval()


def features(
    module: FeatureExtractor, points: torch.Tensor, k: int
) -> tuple[torch.Tensor, torch.Tensor]:
    """Global feature (3, C) and descriptors (N, D)."""
    with torch.no_grad():
        edges = edge_vectors(points, neighbour_mean(points, k))
        latent, feature = module.global_module(edges)
        return feature[0], module.describe(edges, latent, feature)[0]


def relative(a: torch.Tensor, b: torch.Tensor) -> float:
    return float((a - b).norm() / b.norm())


@pytest.mark.parametrize("shared_direction", [False, True])
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_global_features_turn_and_descriptors_stay(shared_direction: bool, seed: int) -> None:
    config = NetworkConfig(**(SMALL.to_dict() | {"shared_direction": shared_direction}))
    module, points = extractor(config), cloud(64, seed)
    rotation = torch.from_numpy(Rotation.random(rng=np.random.default_rng(seed)).as_matrix())
    feature, descriptors = features(module, points, config.neighbours)
    turned, same = features(module, points @ rotation.T, config.neighbours)
    assert relative(turned, rotation @ feature) < 1e-9
    assert relative(same, descriptors) < 1e-9


def test_permutation_changes_nothing() -> None:
    module, points = extractor(SMALL), cloud(64, 3)
    order = torch.from_numpy(np.random.default_rng(1).permutation(64))
    feature, descriptors = features(module, points, SMALL.neighbours)
    same, permuted = features(module, points[:, order], SMALL.neighbours)
    assert relative(same, feature) < 1e-10
    assert relative(permuted, descriptors[order]) < 1e-10


@pytest.mark.parametrize(
    ("switch", "global_turns", "descriptors_stay"),
    [
        ("vector_neurons", False, False),
        ("invariant_layer", True, False),
        ("shared_encoder", True, True),
    ],
)
def test_ablations_lose_what_they_switch_off(
    switch: str, global_turns: bool, descriptors_stay: bool
) -> None:
    config = NetworkConfig(**(SMALL.to_dict() | {switch: False}))
    module, points = extractor(config), cloud(64, 5)
    rotation = torch.from_numpy(Rotation.from_euler("xyz", [80, 40, 20], degrees=True).as_matrix())
    feature, descriptors = features(module, points, config.neighbours)
    turned, other = features(module, points @ rotation.T, config.neighbours)
    assert (relative(turned, rotation @ feature) < 1e-9) == global_turns
    assert (relative(other, descriptors) < 1e-9) == descriptors_stay


def test_mean_of_edges_is_the_papers_edge_feature() -> None:
    """VN-linear of every neighbour's edge, then the mean, as the paper writes it."""
    points, k = cloud(40, 7), 6
    weight = torch.from_numpy(np.random.default_rng(2).normal(size=(3, 5)))
    x = points[0]
    nearest = torch.cdist(x, x).topk(k, largest=False).indices
    expected = torch.zeros(40, 3, 5, dtype=torch.float64)
    for j in nearest.T:
        vectors = torch.stack([x[j] - x, x, torch.linalg.cross(x[j], x)], dim=-1)
        expected += vectors @ weight / k
    ours = edge_vectors(points, neighbour_mean(points, k))[0] @ weight
    assert relative(ours, expected) < 1e-12


def test_kdtree_neighbours_equal_the_sorted_ones() -> None:
    points = np.random.default_rng(0).normal(size=(3, 200, 3)).astype(np.float32)
    expected = neighbour_mean(torch.from_numpy(points), 20).numpy()
    assert np.abs(neighbour_mean_kdtree(points, 20) - expected).max() < 1e-6


def test_scaled_start_gives_features_of_unit_size() -> None:
    torch.manual_seed(0)
    module = FeatureExtractor(SMALL)
    points = torch.cat([cloud(64, s) for s in range(4)]).float()
    edges = edge_vectors(points, neighbour_mean(points, SMALL.neighbours))
    scale_initial_weights(module, edges)
    with torch.no_grad():
        _, feature = module.eval().global_module(edges)
    assert 0.9 < float(feature.square().mean().sqrt()) < 1.1
