"""The network's weights under the names of docs/design.md, batch norms folded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from vnreg_train.networks.encoder import GlobalModule
from vnreg_train.networks.fine import NormedLinear
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.networks.vn import VNLinear, VNLinearNormReLU, VNReLU, VNResNetBlock

Named = Iterator[tuple[str, Tensor]]


def folded_batch_norm(bn: nn.BatchNorm1d) -> tuple[Tensor, Tensor]:
    """(scale, shift) in float64 with BN(x) = scale x + shift in evaluation mode."""
    assert bn.running_mean is not None and bn.running_var is not None
    scale = bn.weight.double() / torch.sqrt(bn.running_var.double() + bn.eps)
    return scale, bn.bias.double() - scale * bn.running_mean.double()


def _block(name: str, block: nn.Module) -> Named:
    assert isinstance(block, VNResNetBlock)
    assert isinstance(block.relu0, VNReLU) and isinstance(block.relu1, VNReLU)
    assert isinstance(block.fc0, VNLinear) and isinstance(block.fc1, VNLinear)
    yield f"{name}.relu0", block.relu0.direction.weight
    yield f"{name}.fc0", block.fc0.linear.weight
    yield f"{name}.relu1", block.relu1.direction.weight
    yield f"{name}.fc1", block.fc1.linear.weight
    if isinstance(block.shortcut, VNLinear):
        yield f"{name}.shortcut", block.shortcut.linear.weight


def _encoder(name: str, module: GlobalModule) -> Named:
    assert isinstance(module.pre, VNLinear) and isinstance(module.global_fc, VNLinear)
    assert isinstance(module.global_relu, VNReLU)
    yield f"{name}.pre", module.pre.linear.weight
    for index, block in enumerate(module.network0):
        yield from _block(f"{name}.network0.{index}", block)
    for index, block in enumerate(module.network1):
        yield from _block(f"{name}.network1.{index}", block)
    yield f"{name}.global.relu", module.global_relu.direction.weight
    yield f"{name}.global.fc", module.global_fc.linear.weight


def _local(network: RegistrationNetwork) -> Named:
    module = network.extractor.local_module
    for index, block in enumerate(module.network2):
        yield from _block(f"local.network2.{index}", block)
    for index, layer in enumerate(module.invariant or ()):
        name = f"local.invariant.{index}"
        if isinstance(layer, VNLinearNormReLU):
            scale, shift = folded_batch_norm(layer.norm.bn)
            yield f"{name}.fc", layer.fc.weight
            yield f"{name}.direction", layer.direction.weight
            yield f"{name}.scale", scale
            yield f"{name}.shift", shift
        else:
            assert isinstance(layer, nn.Linear)
            yield f"{name}.fc", layer.weight
    scale, shift = folded_batch_norm(module.norm)
    yield "local.descriptor.weight", scale[:, None] * module.descriptor.weight.double()
    yield "local.descriptor.bias", shift


def _mlp(name: str, layers: nn.Sequential) -> Named:
    for index, layer in enumerate(layers):
        if isinstance(layer, NormedLinear):
            scale, shift = folded_batch_norm(layer.bn)
            yield f"{name}.{index}.weight", scale[:, None] * layer.linear.weight.double()
            yield f"{name}.{index}.bias", shift
        else:
            assert isinstance(layer, nn.Linear)
            yield f"{name}.{index}.weight", layer.weight
            yield f"{name}.{index}.bias", layer.bias


def engine_tensors(network: RegistrationNetwork) -> dict[str, NDArray[np.float32]]:
    """All tensors of architecture `paper`; float32, row-major (out, in).

    Raises ValueError for the ablations that the engine does not run.
    """
    for name in ("vector_neurons", "weighted_centroids"):
        if not getattr(network.config, name):
            raise ValueError(f"cannot export an ablation: {name} = false")
    named = [*_encoder("encoder", network.extractor.global_module), *_local(network)]
    if network.extractor.local_encoder is not None:
        named += _encoder("local.encoder", network.extractor.local_encoder)
    for part in ("significance", "pair", "similarity", "weight"):
        named += _mlp(f"fine.{part}", getattr(network.fine, part))
    return {
        name: np.ascontiguousarray(tensor.detach().double().numpy(), dtype=np.float32)
        for name, tensor in named
    }
