"""Writes a trained network `vnreg` as a model file, and reads it back."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from vnreg_train.export.architecture import check_architecture
from vnreg_train.model_file import MetadataValue, read_model, write_model
from vnreg_train.networks.descriptor import Block, DescriptorNetwork, Neighbourhood
from vnreg_train.networks.descriptor_config import DescriptorConfig
from vnreg_train.training.checkpoint import read_checkpoint

Metadata = dict[str, int | float | bool | str]

# Metadata key of every number of the configuration (docs/design.md).
COUNTS = {
    "channels.vector": "channels",
    "channels.scalar": "scalars",
    "channels.gate": "gates",
    "channels.product": "products",
    "channels.local_descriptor": "local_descriptor",
    "channels.context_descriptor": "context_descriptor",
    "channels.frame": "frames",
    "channels.global": "global_channels",
    "blocks.local": "local_blocks",
    "blocks.context": "context_blocks",
}


def descriptor_metadata(config: DescriptorConfig, name: str, points: int, encoded: int) -> Metadata:
    """The hyper-parameters of docs/design.md, section Tensors of architecture `vnreg`."""
    metadata: Metadata = {key: getattr(config, field) for key, field in COUNTS.items()}
    metadata |= {f"moments.radius.{i}": float(r) for i, r in enumerate(config.moment_radii)}
    metadata |= {
        "neighbourhood.local": float(config.neighbourhood_radii[0]),
        "neighbourhood.context": float(config.neighbourhood_radii[1]),
    }
    return metadata | {
        "arch": "vnreg",
        "name": name,
        "input.rms_radius": 1.0,
        "input.points": points,
        "input.encoded": encoded,
    }


def descriptor_config(metadata: dict[str, Any]) -> DescriptorConfig:
    """The inverse of `descriptor_metadata`."""
    counts = {field: metadata[key] for key, field in COUNTS.items()}
    first, second, third = (metadata[f"moments.radius.{i}"] for i in range(3))
    neighbourhoods = (metadata["neighbourhood.local"], metadata["neighbourhood.context"])
    return DescriptorConfig(
        **counts, moment_radii=(first, second, third), neighbourhood_radii=neighbourhoods
    )


def _affine(name: str, layer: nn.Linear) -> Iterator[tuple[str, Tensor]]:
    yield f"{name}.weight", layer.weight
    yield f"{name}.bias", layer.bias


def _neighbourhood(name: str, layer: Neighbourhood) -> Iterator[tuple[str, Tensor]]:
    yield from _affine(f"{name}.gate", layer.gate)
    yield f"{name}.collect", layer.linear.weight


def _plain_parameters(network: DescriptorNetwork) -> Iterator[tuple[str, Tensor]]:
    """The tensors of the file that are parameters of the network as they are."""
    yield from _affine("point.gate", network.pre_gate)
    yield "point.block.direction", network.block0.direction.weight
    yield "point.block.linear", network.block0.linear.weight
    yield "point.products", network.invariants0.own.weight
    yield from _affine("point.mlp", network.scalar1)
    yield from _neighbourhood("local", network.neighbourhood0)
    yield from _neighbourhood("context", network.neighbourhood1)
    for stage, blocks in (("local", network.local_blocks), ("context", network.context_blocks)):
        for index, block in enumerate(blocks):
            assert isinstance(block, Block)
            yield f"{stage}.block.{index}.direction", block.direction.weight
            yield f"{stage}.block.{index}.linear", block.linear.weight
            if block.pool is not None:
                yield f"{stage}.block.{index}.pool", block.pool.weight
    yield "local.products", network.invariants1.own.weight
    yield from _affine("local.mlp.0", network.scalar2)
    yield from _affine("local.mlp.1", network.scalar3)
    yield from _affine("local.descriptor", network.local_descriptor)
    yield "local.frames", network.local_frames.weight
    assert network.invariants2.pool is not None
    yield "context.products", network.invariants2.own.weight
    yield "context.products_pooled", network.invariants2.pool.weight
    yield from _affine("context.mlp.0", network.scalar4)
    yield from _affine("context.mlp.1", network.scalar5)
    yield from _affine("context.descriptor", network.context_descriptor)
    yield "context.frames", network.context_frames.weight
    yield from _affine("context.logits", network.logits)
    yield "context.global", network.global_linear.weight


def _folded_inputs(network: DescriptorNetwork) -> Iterator[tuple[str, Tensor]]:
    """The first layers, which take the input scales in, and the descriptors' lengths."""
    weight = network.scalar0.weight.double() * network.scalar_scale.double()
    yield "point.scalars.weight", weight
    yield (
        "point.scalars.bias",
        network.scalar0.bias.double() - weight @ network.scalar_mean.double(),
    )
    yield "point.vectors", network.pre_local.weight.double() * network.local_scale.double()
    yield "context.vectors", network.pre_context.weight.double() * network.context_scale.double()
    yield "lengths", torch.exp(0.5 * network.temperature.double())


def descriptor_tensors(network: DescriptorNetwork) -> dict[str, NDArray[np.float32]]:
    """All tensors of architecture `vnreg`; float32, row-major (out, in)."""
    named = [*_plain_parameters(network), *_folded_inputs(network)]
    return {
        name: np.ascontiguousarray(tensor.detach().double().numpy(), dtype=np.float32)
        for name, tensor in named
    }


def load_descriptor_checkpoint(path: Path) -> tuple[DescriptorNetwork, dict[str, Any]]:
    """A checkpoint's averaged weights in evaluation mode, and its configuration."""
    state = read_checkpoint(path)
    network = DescriptorNetwork(DescriptorConfig.from_dict(state["config"]["network"]))
    network.load_state_dict(state["ema"])
    return network.eval(), state["config"]


def export_descriptor_model(
    network: DescriptorNetwork,
    path: Path,
    name: str,
    points: int = 1024,
    encoded: int = 256,
    extra: Metadata | None = None,
) -> None:
    """Writes the network to `path`; equal weights give equal bytes.

    `points`: what a cloud is subsampled to by default; `encoded`: how many of them are described.
    `extra`: provenance.*, calibration.* keys.
    """
    metadata = descriptor_metadata(network.config, name, points, encoded) | (extra or {})
    write_model(path, metadata, descriptor_tensors(network))


def import_descriptor_model(
    path: str | Path,
) -> tuple[DescriptorNetwork, dict[str, MetadataValue]]:
    """The network of a model file, in evaluation mode, and the file's metadata.

    The input scales are folded into the first layers, so they come back as ones; the judge is a
    network of its own (networks/judge.py). Raises ModelFileError for a broken file and for metadata
    and tensors that no architecture has, and ValueError where it is not architecture `vnreg`.
    """
    metadata, tensors = read_model(path)
    check_architecture(metadata, tensors)
    if metadata.get("arch") != "vnreg":
        raise ValueError(f"{path}: expected architecture 'vnreg', got {metadata.get('arch')!r}")
    network = DescriptorNetwork(descriptor_config(metadata)).eval()
    destinations = dict(_plain_parameters(network)) | {
        "point.scalars.weight": network.scalar0.weight,
        "point.scalars.bias": network.scalar0.bias,
        "point.vectors": network.pre_local.weight,
        "context.vectors": network.pre_context.weight,
        "lengths": network.temperature,
    }
    for name, destination in destinations.items():
        value = torch.from_numpy(tensors[name])
        with torch.no_grad():
            destination.copy_(2 * value.log() if name == "lengths" else value)
    return network, metadata
