"""How much time the shared encoder saves in the engine, and how fast each line of the ablation is.

With random weights, of which time is free. The networks align the same pair in turns, on one
thread; the median of the processor times.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import torch
from torch import nn

import vnreg
from vnreg_train.data.mesh import Float64
from vnreg_train.evaluate.results import cpu_name
from vnreg_train.export.model import export_model
from vnreg_train.export.reference import Reference
from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.paper.registrations import runs_in_engine
from vnreg_train.paper.variants import VARIANTS, variant_config
from vnreg_train.training.config import TrainingConfig, load_config

POINTS = 1024
WARM_UP = 3
TORCH_SHARE = 8  # the reference takes so much longer, about

K = TypeVar("K", bound=Hashable)
Call = Callable[[], object]


def random_network(config: NetworkConfig, seed: int = 0) -> RegistrationNetwork:
    """Weights that keep the scale of features, so that no number is denormal."""
    generator = torch.Generator().manual_seed(seed)
    network = RegistrationNetwork(config)
    for layer in network.modules():
        if isinstance(layer, nn.Linear):
            layer.weight.data.normal_(0, layer.in_features**-0.5, generator=generator)
    return network.eval()


def measure_encoders(config: NetworkConfig, rounds: int) -> dict[str, Any]:
    """Milliseconds (median) and pairs/s with one shared encoder and with two."""
    networks = {
        name: random_network(replace(config, shared_encoder=name == "shared"))
        for name in ("shared", "two")
    }
    with tempfile.TemporaryDirectory() as folder:
        medians = measure_in_turns(engine_calls(networks, Path(folder)), rounds)
    return {
        "ms": medians,
        "pairs_per_second": {name: 1e3 / ms for name, ms in medians.items()},
        "ratio": medians["two"] / medians["shared"],
        "rounds": rounds,
    }


def measure_lines(base: TrainingConfig, rounds: int) -> dict[str, dict[str, float | None]]:
    """Pairs/s of every line of the ablation at the width of `base`: by the engine, None where it
    does not run the line, and by the torch reference. Lines of one network are timed once.
    """
    configs = {name: _network_config(base, name) for name in VARIANTS}
    networks = {config: random_network(config) for config in set(configs.values())}
    reference = {config: _torch_call(network) for config, network in networks.items()}
    with tempfile.TemporaryDirectory() as folder:
        run = {c: network for c, network in networks.items() if runs_in_engine(network)}
        engine_ms = measure_in_turns(engine_calls(run, Path(folder)), rounds)
    torch_ms = measure_in_turns(reference, max(1, rounds // TORCH_SHARE))
    return {
        name: {
            "engine": 1e3 / engine_ms[config] if config in engine_ms else None,
            "torch": 1e3 / torch_ms[config],
        }
        for name, config in configs.items()
    }


def _network_config(base: TrainingConfig, name: str) -> NetworkConfig:
    weighted = VARIANTS[name].weighted_centroids
    return replace(variant_config(base, name).network, weighted_centroids=weighted)


def engine_calls(networks: Mapping[K, RegistrationNetwork], folder: Path) -> dict[K, Call]:
    """One alignment by the engine, on one thread, of each network; model files go to `folder`."""
    calls: dict[K, Call] = {}
    for number, (key, network) in enumerate(networks.items()):
        path = folder / f"{number}.vnr"
        export_model(network, path, "speed")
        registrar = vnreg.Registrar(vnreg.Model.load(path), mode="paper", threads=1)
        calls[key] = partial(registrar.align, *clouds())
    return calls


def _torch_call(network: RegistrationNetwork) -> Call:
    return partial(Reference(network).register, *clouds())


def clouds() -> tuple[Float64, Float64]:
    """Two made-up clouds (POINTS, 3): time does not depend on them."""
    source, target = np.random.default_rng(0).normal(size=(2, POINTS, 3)) * [0.3, 0.2, 0.1]
    return source, target


def measure_in_turns(calls: Mapping[K, Call], rounds: int) -> dict[K, float]:
    """Median processor time of each call in milliseconds; every round makes each call once."""
    times: dict[K, list[float]] = {key: [] for key in calls}
    for number in range(-WARM_UP, rounds):
        for key, call in calls.items():
            start = time.process_time()
            call()
            if number >= 0:
                times[key].append(1e3 * (time.process_time() - start))
    return {key: float(np.median(of)) for key, of in times.items()}


def measure_speed(rounds: int = 41) -> dict[str, Any]:
    """One encoder against two at the paper's width and at that of `small`; every line of the
    ablation at the paper's width.
    """
    torch.set_num_threads(1)
    networks = {name: load_config(name).network for name in ("paper", "small")}
    return {
        "cpu": cpu_name(),
        "instruction_set": vnreg.instruction_set(),
        "points": POINTS,
        "networks": {name: measure_encoders(c, rounds) for name, c in networks.items()},
        "lines": measure_lines(load_config("paper"), rounds),
    }
