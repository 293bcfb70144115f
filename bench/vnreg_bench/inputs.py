"""Clouds and models that are timed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from vnreg_train.export.model import export_model
from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.edges import edge_vectors, neighbour_mean
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.initial import scale_initial_weights

Cloud = NDArray[np.float32]
MODELS = Path(__file__).resolve().parents[2] / "models"
SHIPPED = {"vnreg": MODELS / "vnreg.vnr", "small": MODELS / "small.vnr"}


def bent_box(points: int, seed: int = 0) -> tuple[Cloud, Cloud]:
    """Two samples of a bent box without symmetry, (points, 3) each, the second one turned: size
    and density like those of the furniture, at any number of points."""
    rng = np.random.default_rng(seed)
    sides = np.array([1.0, 0.7, 0.4])
    cloud = rng.uniform(-0.5, 0.5, (2 * points, 3)) * sides
    face = rng.integers(0, 3, 2 * points)
    cloud[np.arange(2 * points), face] = np.sign(rng.normal(size=2 * points)) * 0.5 * sides[face]
    cloud[:, 2] += 0.3 * cloud[:, 0] ** 2 + 0.2 * cloud[:, 0] * cloud[:, 1]
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    source, target = cloud[:points], cloud[points:] @ turn.T
    return source.astype(np.float32), target.astype(np.float32)


def random_paper_model(path: Path, channels: int, points: int = 1024) -> None:
    """A model file of the paper's architecture, C = `channels`, with random weights of working
    size: speed does not depend on them."""
    torch.manual_seed(0)
    local = max(4, channels // 2 // 4 * 4)
    config = NetworkConfig(global_channels=channels, local_channels=local)
    network = RegistrationNetwork(config)
    clouds = torch.from_numpy(np.stack(bent_box(256)))
    edges = edge_vectors(clouds, neighbour_mean(clouds, config.neighbours))
    scale_initial_weights(network.extractor, edges)
    export_model(network.eval(), path, f"random{channels}", points=points)
