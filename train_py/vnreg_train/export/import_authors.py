"""Checkpoints of the paper's authors as networks of ours.

Their repository, github.com/linchengweiii/CFReg, saves a dictionary whose entry `model` is the
state dict of the whole network: `feature_extractor.global_module`, the encoder;
`feature_extractor.local_module`; `coarse_register.decoder`, for training only and left out here;
and `fine_register`. A run of the coarse stage alone has neither local module nor fine register.
Their 1x1 convolutions are our linear layers, and their vector features (channels, 3, points) are
ours in another order of the axes, so every tensor keeps its numbers. Widths and the shared
direction are read off the shapes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.registration import RegistrationNetwork

Names = Iterator[tuple[str, str]]  # ours, theirs

GLOBAL = "feature_extractor.global_module"
LOCAL = "feature_extractor.local_module"
TRAINING_ONLY = ("coarse_register.",)
NORM = ("weight", "bias", "running_mean", "running_var", "num_batches_tracked")
NEIGHBOURS = 20  # a constant of their code, as are the two below
ITERATIONS = 3
KEEP_DIVISOR = 6


class AuthorsCheckpointError(ValueError):
    """A checkpoint that does not have the authors' layout; says what is missing, extra or off."""


@dataclass(frozen=True)
class Imported:
    """The network in evaluation mode, and whether the checkpoint held a fine register."""

    network: RegistrationNetwork
    has_fine: bool


def import_authors(path: Path) -> Imported:
    """The network of a checkpoint file. Raises AuthorsCheckpointError."""
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises many kinds for a file that is none of its own
        raise AuthorsCheckpointError(f"{path}: not a torch checkpoint: {error}") from error
    return from_state_dict(_state_dict(content))


def _state_dict(content: Any) -> dict[str, Tensor]:
    """The tensors of a checkpoint, or of a bare state dict."""
    found = content.get("model", content) if isinstance(content, Mapping) else None
    if not isinstance(found, Mapping) or not all(isinstance(v, Tensor) for v in found.values()):
        raise AuthorsCheckpointError("expected a state dict, or a dictionary with one as 'model'")
    return dict(found)


def from_state_dict(theirs: Mapping[str, Tensor]) -> Imported:
    """The network of a state dict in the authors' layout. Raises AuthorsCheckpointError."""
    has_fine = any(name.startswith((f"{LOCAL}.", "fine_register.")) for name in theirs)
    network = RegistrationNetwork(_config(theirs, has_fine))
    ours = network.state_dict()
    names = dict(_global_names())
    if has_fine:
        names |= dict(_local_names()) | dict(_fine_names())
    # A shortcut is there only where a block's widths differ.
    names = {our: their for our, their in names.items() if our in ours}
    _compare_names(theirs, names)
    with torch.no_grad():
        for our, their in names.items():
            ours[our].copy_(_fitting(theirs[their], ours[our], their))
    return Imported(network.eval(), has_fine)


def _compare_names(theirs: Mapping[str, Tensor], names: Mapping[str, str]) -> None:
    wanted = set(names.values())
    missing = sorted(wanted - set(theirs))
    extra = sorted(name for name in set(theirs) - wanted if not name.startswith(TRAINING_ONLY))
    if missing:
        raise AuthorsCheckpointError(f"missing tensors: {_listed(missing)}")
    if extra:
        raise AuthorsCheckpointError(f"tensors that the network does not have: {_listed(extra)}")


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(names[:5]) + more


def _fitting(tensor: Tensor, like: Tensor, name: str) -> Tensor:
    """The tensor in our shape: a 1x1 convolution's kernel axes are dropped."""
    found = tuple(tensor.shape)
    while tensor.dim() > like.dim() and tensor.shape[-1] == 1:
        tensor = tensor.squeeze(-1)
    if tensor.shape != like.shape:
        raise AuthorsCheckpointError(f"{name}: expected shape {tuple(like.shape)}, got {found}")
    if not torch.isfinite(tensor).all():
        raise AuthorsCheckpointError(f"{name}: expected finite numbers")
    return tensor.to(like.dtype)


def _rows(theirs: Mapping[str, Tensor], name: str) -> int:
    """How many outputs the layer with this weight has."""
    if name not in theirs:
        raise AuthorsCheckpointError(f"missing tensors: {name}")
    if theirs[name].dim() < 2:
        raise AuthorsCheckpointError(f"{name}: expected a matrix, got {tuple(theirs[name].shape)}")
    return theirs[name].shape[0]


def _config(theirs: Mapping[str, Tensor], has_fine: bool) -> NetworkConfig:
    channels = _rows(theirs, f"{GLOBAL}.fc_global.map_to_feat.weight")
    directions = _rows(theirs, f"{GLOBAL}.actvn_global.map_to_dir.weight")
    common: dict[str, Any] = {
        "global_channels": channels,
        "neighbours": NEIGHBOURS,
        "shared_direction": directions == 1 and channels > 1,
        "keep_divisor": KEEP_DIVISOR,
        "input_rms_radius": 0.0,
    }
    if not has_fine:
        return NetworkConfig(fine_iterations=0, **common)
    significance = [_rows(theirs, f"fine_register.sig_fc.conv.{i}.conv.weight") for i in (0, 1)]
    return NetworkConfig(
        local_channels=_rows(theirs, f"{LOCAL}.vn_network_2.blocks.1.fc1.map_to_feat.weight"),
        descriptor_channels=_rows(theirs, f"{LOCAL}.conv_local.weight"),
        pair_channels=_rows(theirs, "fine_register.sim_feat_conv.conv.1.weight"),
        significance_channels=(significance[0], significance[1]),
        fine_iterations=ITERATIONS,
        **common,
    )


def _block(ours: str, theirs: str) -> Names:
    for index in (0, 1):
        relu = f"{ours}.relu{index}.direction.weight"
        yield relu, f"{theirs}.actvn{index}.map_to_dir.weight"
        yield f"{ours}.fc{index}.linear.weight", f"{theirs}.fc{index}.map_to_feat.weight"
    yield f"{ours}.shortcut.linear.weight", f"{theirs}.shortcut.map_to_feat.weight"


def _norm(ours: str, theirs: str) -> Names:
    yield from ((f"{ours}.{name}", f"{theirs}.{name}") for name in NORM)


def _global_names() -> Names:
    ours = "extractor.global_module"
    yield f"{ours}.pre.linear.weight", f"{GLOBAL}.fc_pre.map_to_feat.weight"
    for network, blocks in ((0, 3), (1, 2)):
        for i in range(blocks):
            theirs = f"{GLOBAL}.vn_network_{network}.blocks.{i}"
            yield from _block(f"{ours}.network{network}.{i}", theirs)
    yield f"{ours}.global_relu.direction.weight", f"{GLOBAL}.actvn_global.map_to_dir.weight"
    yield f"{ours}.global_fc.linear.weight", f"{GLOBAL}.fc_global.map_to_feat.weight"


def _local_names() -> Names:
    ours = "extractor.local_module"
    for i in (0, 1):
        yield from _block(f"{ours}.network2.{i}", f"{LOCAL}.vn_network_2.blocks.{i}")
        layer, theirs = f"{ours}.invariant.{i}", f"{LOCAL}.std_feature.vn{i + 1}"
        yield f"{layer}.fc.weight", f"{theirs}.map_to_feat.weight"
        yield f"{layer}.direction.weight", f"{theirs}.map_to_dir.weight"
        yield from _norm(f"{layer}.norm.bn", f"{theirs}.batchnorm.bn")
    yield f"{ours}.invariant.2.weight", f"{LOCAL}.std_feature.vn_lin.weight"
    yield f"{ours}.descriptor.weight", f"{LOCAL}.conv_local.weight"
    yield from _norm(f"{ours}.norm", f"{LOCAL}.bn_local")


def _fine_names() -> Names:
    parts = {
        "significance": ("sig_fc", 2),
        "pair": ("sim_feat_conv", 1),
        "similarity": ("sim_mat_conv", 1),
        "weight": ("weight_fc", 1),
    }
    for part, (their_part, hidden) in parts.items():
        ours, theirs = f"fine.{part}", f"fine_register.{their_part}.conv"
        for i in range(hidden):
            yield f"{ours}.{i}.linear.weight", f"{theirs}.{i}.conv.weight"
            yield from _norm(f"{ours}.{i}.bn", f"{theirs}.{i}.bn")
        for name in ("weight", "bias"):
            yield f"{ours}.{hidden}.{name}", f"{theirs}.{hidden}.{name}"
