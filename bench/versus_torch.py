"""Milliseconds per pair: the engine beside torch eager, same weights, interleaved in one run.

Torch runs the network as one would in torch: both clouds in one batch, neighbours by `cdist` and
`topk`, under `no_grad`. Both sides go from two clouds to a pose, coarse and fine.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # two OpenMP runtimes share the cores

import argparse
import json
import platform
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

import vnreg
from vnreg_train.export.model import export_model
from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.edges import edge_vectors
from vnreg_train.networks.fine import gather_points
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.config import load_config
from vnreg_train.training.initial import scale_initial_weights

Cloud = NDArray[np.float32]


def test_pair(points: int) -> tuple[Cloud, Cloud]:
    """Two samples of a bent box, one turned: sizes and densities like those of the furniture."""
    rng = np.random.default_rng(0)
    cloud = rng.uniform(-0.5, 0.5, (2 * points, 3)) * [1.0, 0.7, 0.4]
    face = rng.integers(0, 3, 2 * points)
    side = np.sign(rng.normal(size=2 * points)) * 0.5 * np.array([1.0, 0.7, 0.4])[face]
    cloud[np.arange(2 * points), face] = side
    cloud[:, 2] += 0.3 * cloud[:, 0] ** 2
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    source, target = cloud[:points], cloud[points:] @ turn.T
    return source.astype(np.float32), target.astype(np.float32)


def torch_edges(clouds: torch.Tensor, k: int) -> torch.Tensor:
    nearest = torch.cdist(clouds, clouds).topk(k, largest=False, sorted=False).indices
    batch = torch.arange(len(clouds))[:, None, None]
    return edge_vectors(clouds, clouds[batch, nearest].mean(2))


@torch.no_grad()
def torch_register(network: RegistrationNetwork, source: Cloud, target: Cloud) -> torch.Tensor:
    """The pose in network coordinates, as the reference defines them."""
    clouds = torch.from_numpy(np.stack([source, target]))
    clouds = clouds - clouds.mean(1, keepdim=True)
    edges = torch_edges(clouds, network.config.neighbours)
    latent, feature = network.encode(edges)
    rotation, translation = procrustes(*feature.transpose(1, 2).split(1))
    descriptors = network.extractor.describe(edges, latent, feature)
    _, kept = network.fine.keep(descriptors)
    x = clouds[:1] @ rotation.transpose(1, 2) + translation.unsqueeze(1)
    steps = network.fine.run(
        gather_points(x, kept[:1]),
        gather_points(clouds[1:], kept[1:]),
        gather_points(descriptors[:1], kept[:1]),
        gather_points(descriptors[1:], kept[1:]),
    )
    return steps[-1].rotation @ rotation


def networks() -> dict[str, RegistrationNetwork]:
    """Both shipped widths with random weights of working size."""
    made = {}
    for name in ("small", "paper"):
        torch.manual_seed(0)
        network = RegistrationNetwork(load_config(name).network)
        source, target = test_pair(256)
        scale_initial_weights(
            network.extractor, torch_edges(torch.from_numpy(np.stack([source, target])), 20)
        )
        made[name] = network.eval()
    return made


def runners(
    network: RegistrationNetwork, pair: tuple[Cloud, Cloud]
) -> dict[str, Callable[[], Any]]:
    """What is timed, by label. The engine's clouds are those of torch: nothing is subsampled."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "random.vnr"
        export_model(network, path, "random", points=len(pair[0]))
        model = vnreg.Model.load(str(path))
    work: dict[str, Callable[[], Any]] = {}
    for threads in (1, 2):
        registrar = vnreg.Registrar(model, mode="paper", threads=threads)

        def engine(registrar: vnreg.Registrar = registrar) -> None:
            registrar.align(*pair)

        def eager(threads: int = threads) -> None:
            torch.set_num_threads(threads)
            torch_register(network, *pair)

        work[f"engine, {threads} thread{'s' if threads > 1 else ''}"] = engine
        work[f"torch eager, {threads} thread{'s' if threads > 1 else ''}"] = eager
    return work


def interleaved(work: dict[str, Callable[[], Any]], rounds: int) -> dict[str, list[float]]:
    """Milliseconds of every round, each round running everything once."""
    times: dict[str, list[float]] = {label: [] for label in work}
    for round_number in range(rounds + 3):
        for label, run in work.items():
            started = time.perf_counter()
            run()
            if round_number >= 3:  # the first rounds warm up
                times[label].append(1e3 * (time.perf_counter() - started))
    return times


def cpu_name() -> str:
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=1024)
    parser.add_argument("--rounds", type=int, default=31)
    parser.add_argument("--json", type=Path, default=Path("build/reports/versus_torch.json"))
    arguments = parser.parse_args()
    pair = test_pair(arguments.points)
    rows = []
    for name, network in networks().items():
        times = interleaved(runners(network, pair), arguments.rounds)
        rows += [
            {"network": name, "what": label, "median_ms": statistics.median(t), "min_ms": min(t)}
            for label, t in times.items()
        ]
    report = {
        "cpu": cpu_name(),
        "instruction_set": vnreg.instruction_set(),
        "torch": torch.__version__,
        "points": arguments.points,
        "rounds": arguments.rounds,
        "rows": rows,
    }
    arguments.json.parent.mkdir(parents=True, exist_ok=True)
    arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    print(
        f"{report['cpu']}, {report['instruction_set']}, torch {torch.__version__}, "
        f"{arguments.points} points a cloud, {arguments.rounds} interleaved rounds\n"
    )
    print("| network | what | median ms | min ms |\n|---|---|---:|---:|")
    for row in rows:
        print(
            f"| {row['network']} | {row['what']} | {row['median_ms']:.1f} | {row['min_ms']:.1f} |"
        )


if __name__ == "__main__":
    main()
