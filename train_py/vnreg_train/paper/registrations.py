"""Coarse and final poses of a trained variant: by the engine, or in torch where it must be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import vnreg
from vnreg_train.data.mesh import Float64
from vnreg_train.data.protocol import Pair
from vnreg_train.export.model import export_model
from vnreg_train.export.reference import Reference, to_user_units
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.batches import network_scale


@dataclass(frozen=True)
class Poses:
    """T_target_source (4, 4) after the coarse and after the fine register; NaN without a pose."""

    coarse: Float64
    fine: Float64


Register = Callable[[Pair], Poses]


def runs_in_engine(network: RegistrationNetwork) -> bool:
    """The engine has no layers that are not equivariant, and weighs the centroids."""
    return network.config.vector_neurons and network.config.weighted_centroids


def make_register(network: RegistrationNetwork, model_path: Path) -> Register:
    """Through the engine from a file written to `model_path`, else by the torch reference."""
    if not runs_in_engine(network):
        return _by_reference(Reference(network))
    model_path.parent.mkdir(parents=True, exist_ok=True)
    export_model(network, model_path, "ablation")
    return engine_register(model_path)


def engine_register(model_path: Path) -> Register:
    """By the engine in mode `paper`, on one thread."""
    registrar = vnreg.Registrar(vnreg.Model.load(model_path), mode="paper", threads=1)

    def register(pair: Pair) -> Poses:
        result = registrar.align(pair.source, pair.target)
        if not result.has_pose:
            nothing = np.full((4, 4), np.nan)
            return Poses(nothing, nothing)
        return Poses(result.T_target_source_coarse, result.T_target_source)

    return register


def _by_reference(reference: Reference) -> Register:
    def register(pair: Pair) -> Poses:
        stages = reference.register(pair.source, pair.target)
        x, y = (np.asarray(cloud, np.float64) for cloud in (pair.source, pair.target))
        centres = x.mean(0), y.mean(0)
        radius = reference.network.config.input_rms_radius
        scale = network_scale((x - centres[0])[None], (y - centres[1])[None], radius)[0]
        coarse = to_user_units(stages["coarse.T"], *centres, float(scale))
        return Poses(coarse, stages["T_target_source"])

    return register
