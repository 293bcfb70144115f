"""How much time the shared encoder saves in the engine: with random weights, of which time is free.

Both networks align the same pair in turns, on one thread; the median of the processor times.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

import vnreg
from vnreg_train.evaluate.results import cpu_name
from vnreg_train.export.model import export_model
from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.config import load_config

POINTS = 1024
WARM_UP = 3


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
    rng = np.random.default_rng(0)
    source, target = rng.normal(size=(2, POINTS, 3)) * [0.3, 0.2, 0.1]
    times: dict[str, list[float]] = {"shared": [], "two": []}
    with tempfile.TemporaryDirectory() as folder:
        registrars = {}
        for name in times:
            path = Path(folder) / f"{name}.vnr"
            export_model(
                random_network(replace(config, shared_encoder=name == "shared")), path, name
            )
            model = vnreg.Model.load(path)
            registrars[name] = vnreg.Registrar(model, mode="paper", threads=1)
        for number in range(-WARM_UP, rounds):
            for name, registrar in registrars.items():
                start = time.process_time()
                registrar.align(source, target)
                if number >= 0:
                    times[name].append(1e3 * (time.process_time() - start))
    medians = {name: float(np.median(of)) for name, of in times.items()}
    return {
        "ms": medians,
        "pairs_per_second": {name: 1e3 / ms for name, ms in medians.items()},
        "ratio": medians["two"] / medians["shared"],
        "rounds": rounds,
    }


def measure_speed(rounds: int = 41) -> dict[str, Any]:
    """At the paper's width and at that of `small`."""
    networks = {name: load_config(name).network for name in ("paper", "small")}
    return {
        "cpu": cpu_name(),
        "instruction_set": vnreg.instruction_set(),
        "points": POINTS,
        "networks": {name: measure_encoders(c, rounds) for name, c in networks.items()},
    }
