"""The program under test, and the files it is given."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import torch
from cli_program import Program, Run, moved, random_pose, repository
from numpy.typing import NDArray

from vnreg_train.export.model import export_golden, export_model
from vnreg_train.export.reference import Reference
from vnreg_train.model_file import read_model, write_model
from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.registration import RegistrationNetwork


@pytest.fixture(scope="session")
def program_path() -> Path:
    """The built program: the environment variable VNREG_CLI, or the release build."""
    path = Path(os.environ.get("VNREG_CLI", repository / "build" / "release" / "vnreg"))
    assert path.is_file(), f"no program at {path}: build it, or set VNREG_CLI"
    return path.resolve()


@pytest.fixture(scope="session")
def vnreg(program_path: Path) -> Program:
    """Runs the program as a user would: vnreg("align", a, b, "--json")."""

    def run(*arguments: str | Path, stdin: bytes | None = None) -> Run:
        command = [str(program_path), *map(str, arguments)]
        done = subprocess.run(command, input=stdin, capture_output=True, timeout=120, check=False)
        return Run(done.returncode, done.stdout.decode(), done.stderr.decode())

    return run


@pytest.fixture(scope="session")
def network(shape: NDArray[np.float64]) -> RegistrationNetwork:
    """A narrow network with arbitrary weights, also in the layers that training starts at zero.

    Its batch norms have seen a cloud: otherwise all points would look alike to the fine register,
    and rounding would choose between them.
    """
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
    reference = Reference(network)
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm1d | torch.nn.BatchNorm2d):
            module.momentum = 1.0
            module.train()
    reference.register(shape, shape)
    return network.eval()


@pytest.fixture(scope="session")
def model(network: RegistrationNetwork, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model file with arbitrary weights."""
    path = tmp_path_factory.mktemp("model") / "arbitrary.vnr"
    export_model(network, path, "arbitrary", points=256, extra={"provenance.data": "none"})
    return path


@pytest.fixture(scope="session")
def golden(network: RegistrationNetwork, model: Path, shape: NDArray[np.float64]) -> Path:
    """What torch computes with that model; lies beside it, so that it is found by default."""
    path = model.with_suffix(".golden.vnr")
    random = np.random.default_rng(3)
    target = moved(random_pose(4), shape + random.normal(0, 0.05, shape.shape))
    export_golden(network, model, path, shape[:200], target[:180])
    metadata, tensors = read_model(path)
    # With arbitrary weights the similarities magnify the rounding of the coarse pose.
    kept = {name: tensor for name, tensor in tensors.items() if not name.endswith("similarity")}
    write_model(path, metadata, kept)
    return path


@pytest.fixture(scope="session")
def shape() -> NDArray[np.float64]:
    """300 points of a body without symmetry: a bent, tapered tube with a fin. Radius about 1."""
    random = np.random.default_rng(2)
    along = random.uniform(-1, 1, 220)
    around = random.uniform(0, 2 * np.pi, 220)
    radius = 0.25 + 0.15 * along
    tube = np.stack(
        [along, 0.4 * along**2 + radius * np.cos(around), 0.2 * along + radius * np.sin(around)], 1
    )
    fin = np.stack([random.uniform(0.2, 0.8, 80), random.uniform(0.3, 1.1, 80), np.zeros(80)], 1)
    return np.concatenate([tube, fin])
