"""A model with arbitrary weights, and a pair of clouds whose pose is known."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

import vnreg
from vnreg_train.export.model import export_model
from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.registration import RegistrationNetwork

Points = NDArray[np.float64]


@dataclass(frozen=True)
class KnownPair:
    """target = source moved by T_target_source, in another order; (300, 3) float64 each."""

    source: Points
    target: Points
    T_target_source: Points


@pytest.fixture(scope="session")
def model_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small network with arbitrary weights, also in the layers that training starts at zero."""
    torch.manual_seed(1)
    config = NetworkConfig(
        global_channels=16,
        local_channels=8,
        descriptor_channels=8,
        pair_channels=8,
        significance_channels=(8, 4),
        neighbours=8,
        input_rms_radius=0.4,
    )
    network = RegistrationNetwork(config)
    with torch.no_grad():
        for parameter in network.parameters():
            if not parameter.any():
                parameter.uniform_(-0.2, 0.2)
    path = tmp_path_factory.mktemp("model") / "arbitrary.vnr"
    export_model(network.eval(), path, "arbitrary", points=512)
    return path


@pytest.fixture(scope="session")
def model(model_path: Path) -> vnreg.Model:
    return vnreg.Model.load(model_path)


@pytest.fixture(scope="session")
def pair() -> KnownPair:
    """The coarse register solves it with any weights: it is exactly equivariant."""
    rng = np.random.default_rng(7)
    source = rng.normal(size=(300, 3)) * [0.5, 0.3, 0.15] + rng.normal(size=3)
    source[:, 1] += source[:, 0] ** 2
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation *= np.linalg.det(rotation)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, [1.0, -2.0, 0.5]
    target = source @ rotation.T + pose[:3, 3]
    return KnownPair(source, rng.permutation(target), pose)
