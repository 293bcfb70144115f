"""Networks with random weights whose activations have the scales of trained ones.

The initial weights that training starts from would test little: the last layer of every residual
branch is zero, batch norms are the identity, and vectors of one point are nearly parallel.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.edges import edge_vectors, neighbour_mean
from vnreg_train.networks.encoder import GlobalModule
from vnreg_train.networks.fine import NormedLinear, gather_points
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.networks.vn import VNLinear
from vnreg_train.training.batches import network_scale


def random_cloud(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Points on an uneven closed surface of about longest side 1, (count, 3)."""
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    bumps = 1 + 0.3 * np.sin(3 * direction[:, 0] + 1) + 0.2 * np.cos(5 * direction[:, 1])
    return direction * bumps[:, None] * [0.45, 0.3, 0.2]


def random_network(config: NetworkConfig, seed: int) -> RegistrationNetwork:
    """In evaluation mode; a pure function of its arguments."""
    generator = torch.Generator().manual_seed(seed)
    network = RegistrationNetwork(config)
    for layer in network.modules():
        if isinstance(layer, nn.Linear):
            layer.weight.data.normal_(0, layer.in_features**-0.5, generator=generator)
            if layer.bias is not None:
                layer.bias.data.normal_(0, 0.1, generator=generator)
        elif isinstance(layer, nn.BatchNorm1d) and layer.affine:
            layer.weight.data.uniform_(0.5, 1.5, generator=generator)
            layer.bias.data.normal_(0, 0.2, generator=generator)
    rng = np.random.default_rng(seed)
    points = _network_coordinates(
        np.stack([random_cloud(rng, 256) for _ in range(4)]), config.input_rms_radius
    )
    edges = edge_vectors(points, neighbour_mean(points, config.neighbours))
    _whiten_edges(network, edges)
    _calibrate_batch_norms(network, points, edges)
    _match_nearest_points(network)
    return network.eval()


def _network_coordinates(clouds: NDArray[np.float64], rms_radius: float) -> Tensor:
    clouds = clouds - clouds.mean(1, keepdims=True)
    scale = network_scale(clouds, clouds, rms_radius)[:, None, None]
    return torch.from_numpy((clouds / scale).astype(np.float32))


def _whiten_edges(network: RegistrationNetwork, edges: Tensor) -> None:
    """Scales the first layers' columns, so that their three input vectors count alike."""
    for module in network.extractor.modules():
        if isinstance(module, GlobalModule):
            assert isinstance(module.pre, VNLinear)
            module.pre.linear.weight.data /= edges.square().sum(2).mean((0, 1)).sqrt()


@torch.no_grad()
def _calibrate_batch_norms(network: RegistrationNetwork, points: Tensor, edges: Tensor) -> None:
    """Batch statistics of the given clouds, accumulated by one pass in training mode."""
    norms = [layer for layer in network.modules() if isinstance(layer, nn.BatchNorm1d)]
    for norm in norms:
        norm.momentum = None  # cumulative average
        norm.reset_running_stats()
    network.train()
    latent, feature = network.extractor.global_module(edges)
    descriptors = network.extractor.describe(edges, latent, feature)
    _, kept = network.fine.keep(descriptors)
    x, f = gather_points(points, kept), gather_points(descriptors, kept)
    network.fine.run(x[:2], x[2:], f[:2], f[2:])


def _match_nearest_points(network: RegistrationNetwork) -> None:
    """Lets one pair channel carry max(0, 1 - 2 distance) to the similarity, beside the random rest.

    Random similarities match most points to the same few, which leaves the rotation undetermined.
    """
    first, second = network.fine.pair[0], network.fine.pair[1]
    hidden, last = network.fine.similarity[0], network.fine.similarity[1]
    assert isinstance(first, NormedLinear) and isinstance(hidden, NormedLinear)
    assert isinstance(second, nn.Linear) and isinstance(last, nn.Linear)
    for layer, bias in ((first, 1.0), (hidden, 0.0)):
        layer.linear.weight.data[0] = 0
        bn = layer.bn
        assert bn.running_mean is not None and bn.running_var is not None
        bn.running_mean[0], bn.running_var[0] = 0, 1 - bn.eps
        bn.weight.data[0], bn.bias.data[0] = 1, bias
    distance_column = first.linear.in_features - 4
    first.linear.weight.data[0, distance_column] = -2
    hidden.linear.weight.data[0, 0] = 1
    second.weight.data[0] = 0
    second.weight.data[0, 0] = 1
    second.bias.data[0] = 0
    last.weight.data *= 0.1
    last.weight.data[0, 0] = 10
