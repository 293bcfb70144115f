"""Reads a `.vnr` model file back into torch: the inverse of `export_model`, where the file allows.

The file's batch norms are folded, so the network comes back with batch norms that only scale and
shift; the decoder, which no file holds, keeps its initial weights. Such a network can be evaluated
and exported (to the same bytes), but training should go on from a checkpoint.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import torch
from torch import Tensor, nn

from vnreg_train.export.architecture import check_architecture
from vnreg_train.export.model import config_from_metadata
from vnreg_train.model_file import MetadataValue, read_model
from vnreg_train.networks.encoder import GlobalModule
from vnreg_train.networks.fine import NormedLinear
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.networks.vn import VNLinear, VNLinearNormReLU, VNReLU, VNResNetBlock

Named = Iterator[tuple[str, Tensor]]


def neutralise(bn: nn.BatchNorm1d) -> None:
    """Makes BN(x) = weight x + bias in evaluation mode, exactly; starts as the identity."""
    assert bn.running_mean is not None and bn.running_var is not None
    bn.eps = 0.0
    nn.init.zeros_(bn.running_mean)
    nn.init.ones_(bn.running_var)
    nn.init.ones_(bn.weight)
    nn.init.zeros_(bn.bias)


def _block(name: str, block: nn.Module) -> Named:
    assert isinstance(block, VNResNetBlock)
    for part in ("relu0", "relu1"):
        relu = getattr(block, part)
        assert isinstance(relu, VNReLU)
        yield f"{name}.{part}", relu.direction.weight
    for part in ("fc0", "fc1", "shortcut"):
        layer = getattr(block, part)
        if isinstance(layer, VNLinear):
            yield f"{name}.{part}", layer.linear.weight


def _encoder(name: str, module: GlobalModule) -> Named:
    assert isinstance(module.pre, VNLinear) and isinstance(module.global_fc, VNLinear)
    assert isinstance(module.global_relu, VNReLU)
    yield f"{name}.pre", module.pre.linear.weight
    yield f"{name}.global.relu", module.global_relu.direction.weight
    yield f"{name}.global.fc", module.global_fc.linear.weight
    for part in ("network0", "network1"):
        for index, block in enumerate(getattr(module, part)):
            yield from _block(f"{name}.{part}.{index}", block)


def _extractor(network: RegistrationNetwork) -> Named:
    extractor, local = network.extractor, network.extractor.local_module
    yield from _encoder("encoder", extractor.global_module)
    if extractor.local_encoder is not None:
        yield from _encoder("local.encoder", extractor.local_encoder)
    for index, block in enumerate(local.network2):
        yield from _block(f"local.network2.{index}", block)
    for index, layer in enumerate(local.invariant or ()):
        name = f"local.invariant.{index}"
        if isinstance(layer, VNLinearNormReLU):
            yield f"{name}.fc", layer.fc.weight
            yield f"{name}.direction", layer.direction.weight
            yield f"{name}.scale", layer.norm.bn.weight
            yield f"{name}.shift", layer.norm.bn.bias
        else:
            assert isinstance(layer, nn.Linear)
            yield f"{name}.fc", layer.weight
    yield "local.descriptor.weight", local.descriptor.weight
    yield "local.descriptor.bias", local.norm.bias


def _mlp(name: str, layers: nn.Sequential) -> Named:
    for index, layer in enumerate(layers):
        if isinstance(layer, NormedLinear):
            yield f"{name}.{index}.weight", layer.linear.weight
            yield f"{name}.{index}.bias", layer.bn.bias
        else:
            assert isinstance(layer, nn.Linear)
            yield f"{name}.{index}.weight", layer.weight
            yield f"{name}.{index}.bias", layer.bias


def _destinations(network: RegistrationNetwork) -> Named:
    """Where each tensor of the file belongs."""
    yield from _extractor(network)
    for part in ("significance", "pair", "similarity", "weight"):
        yield from _mlp(f"fine.{part}", getattr(network.fine, part))


def import_model(path: str | Path) -> tuple[RegistrationNetwork, dict[str, MetadataValue]]:
    """The network of a model file, in evaluation mode, and the file's metadata.

    Raises ModelFileError for a broken file and for metadata and tensors that no architecture has,
    and ValueError where it is not architecture `paper`.
    """
    metadata, tensors = read_model(path)
    check_architecture(metadata, tensors)
    if metadata.get("arch") != "paper":
        raise ValueError(f"{path}: expected architecture 'paper', got {metadata.get('arch')!r}")
    network = RegistrationNetwork(config_from_metadata(metadata)).eval()
    for module in (network.extractor, network.fine):
        for layer in module.modules():
            if isinstance(layer, nn.BatchNorm1d):
                neutralise(layer)
    for name, destination in _destinations(network):
        with torch.no_grad():
            destination.copy_(torch.from_numpy(tensors[name]))
    return network, metadata
