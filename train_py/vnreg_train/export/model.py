"""Writes a trained network as a `.vnr` model file and its golden file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vnreg_train.export.reference import Reference
from vnreg_train.export.tensors import engine_tensors
from vnreg_train.model_file import read_checksum, read_model, write_model
from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.checkpoint import read_checkpoint

Metadata = dict[str, int | float | bool | str]
ENGINE_ABLATIONS = ("shared_encoder", "invariant_layer")  # in a file only where false


def network_metadata(config: NetworkConfig, name: str, points: int) -> Metadata:
    """The hyper-parameters of docs/design.md, section Tensors."""
    first, second = config.significance_channels
    ablations: Metadata = {
        f"ablation.{name}": False for name in ENGINE_ABLATIONS if not getattr(config, name)
    }
    return ablations | {
        "arch": "paper",
        "name": name,
        "channels.global": config.global_channels,
        "channels.local": config.local_channels,
        "channels.descriptor": config.descriptor_channels,
        "channels.pair": config.pair_channels,
        "channels.significance.0": first,
        "channels.significance.1": second,
        "neighbours": config.neighbours,
        "relu.shared_direction": config.shared_direction,
        "fine.iterations": config.fine_iterations,
        "fine.keep_divisor": config.keep_divisor,
        "input.rms_radius": float(config.input_rms_radius),
        "input.points": points,
    }


def config_from_metadata(metadata: dict[str, Any]) -> NetworkConfig:
    """The inverse of `network_metadata`, as far as the engine needs it."""
    return NetworkConfig(
        global_channels=metadata["channels.global"],
        local_channels=metadata["channels.local"],
        descriptor_channels=metadata["channels.descriptor"],
        pair_channels=metadata["channels.pair"],
        significance_channels=(
            metadata["channels.significance.0"],
            metadata["channels.significance.1"],
        ),
        neighbours=metadata["neighbours"],
        shared_direction=metadata["relu.shared_direction"],
        fine_iterations=metadata["fine.iterations"],
        keep_divisor=metadata["fine.keep_divisor"],
        input_rms_radius=metadata["input.rms_radius"],
        **{name: metadata.get(f"ablation.{name}", True) for name in ENGINE_ABLATIONS},
    )


def export_model(
    network: RegistrationNetwork,
    path: Path,
    name: str,
    points: int = 1024,
    extra: Metadata | None = None,
) -> None:
    """Writes the network, in evaluation mode, to `path`; equal weights give equal bytes.

    `points`: what a cloud is subsampled to by default. `extra`: provenance.*, calibration.* keys.
    """
    metadata = network_metadata(network.config, name, points) | (extra or {})
    write_model(path, metadata, engine_tensors(network))


def load_checkpoint(path: Path) -> tuple[RegistrationNetwork, dict[str, Any]]:
    """A checkpoint's averaged weights in evaluation mode, and its configuration."""
    state = read_checkpoint(path)
    network = RegistrationNetwork(NetworkConfig.from_dict(state["config"]["network"]))
    network.load_state_dict(state["ema"])
    return network.eval(), state["config"]


def export_golden(
    network: RegistrationNetwork,
    model_path: Path,
    path: Path,
    source: NDArray[np.float64],
    target: NDArray[np.float64],
) -> None:
    """Two clouds (N, 3), (M, 3) and every activation that torch computes for them, for `selftest`.

    Clouds no larger than `input.points`, so that no subsampling takes part.
    """
    metadata, _ = read_model(model_path)
    stages = Reference(network).register(source, target)
    tensors: dict[str, NDArray[np.generic]] = {"input.source": source, "input.target": target}
    stages.pop("T_target_source")  # the rest is in network coordinates
    tensors |= {f"stage.{name}": value for name, value in stages.items()}
    golden: Metadata = {
        "arch": "golden",
        "model.name": str(metadata["name"]),
        "model.crc": read_checksum(model_path),
    }
    write_model(path, golden, tensors)
