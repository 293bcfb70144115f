"""Trains and measures every line of the ablation, equally long, one after the other.

A run's folder has one folder a variant: checkpoints, curves, the model file and result.json. What
is there is not done again, so an interrupted run goes on.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

# TensorBoard has no types.
from tensorboard.backend.event_processing.event_accumulator import (  # type: ignore[import-untyped]
    EventAccumulator,
)

from vnreg_train.data.mesh import Float64
from vnreg_train.data.protocol import Pair, rotation_error_deg, translation_error
from vnreg_train.data.shapes import load_shapes
from vnreg_train.evaluate.measures import share
from vnreg_train.evaluate.rows import ROWS
from vnreg_train.evaluate.run import Pairing
from vnreg_train.evaluate.scores import LIMITS, within
from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.paper.registrations import Register, make_register, runs_in_engine
from vnreg_train.paper.variants import VARIANTS, variant_config
from vnreg_train.training.checkpoint import read_checkpoint
from vnreg_train.training.config import TrainingConfig
from vnreg_train.training.train import StageTrainer

ROW = ROWS["P0/independent/180"]
STAGES = ("coarse", "fine")
CURVES = {"coarse": ("registration", "recall"), "fine": ("match", "recall")}
CURVE_POINTS = 10


def run_ablation(
    base: TrainingConfig, folder: Path, pairing: Pairing, names: Sequence[str]
) -> dict[str, Any]:
    """The results of the variants, by name; trains and measures what the folder lacks."""
    results = {}
    for name in names:
        path = folder / name / "result.json"
        wanted = _identity(base, name, pairing)
        known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
        if known.get("identity") != wanted:
            known = _train_and_measure(base, folder, pairing, name) | {"identity": wanted}
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(known) + "\n", encoding="utf-8")
        results[name] = {key: value for key, value in known.items() if key != "identity"}
    return results


def _identity(base: TrainingConfig, name: str, pairing: Pairing) -> dict[str, Any]:
    """All that a result depends on."""
    variant = VARIANTS[name]
    content = {
        "config": asdict(variant_config(base, variant.trained_as or name)),
        "averaged": variant.averaged,
        "weighted_centroids": variant.weighted_centroids,
        "pairs": [pairing.split, pairing.seed, len(pairing.indices()), ROW.name],
    }
    return dict(json.loads(json.dumps(content)))


def _train_and_measure(
    base: TrainingConfig, folder: Path, pairing: Pairing, name: str
) -> dict[str, Any]:
    variant = VARIANTS[name]
    trained = variant.trained_as or name
    config = variant_config(base, trained)
    run = folder / trained
    for stage in STAGES:
        train_stage(config, stage, run, pairing.data)
    network = load_variant(run / "fine.pt", config, name)
    register = make_register(network, folder / name / "model.vnr")
    pairs = list(pairing.pairs(ROW))
    return {
        "engine": runs_in_engine(network),
        "recall": recalls(pairs, register),
        "curves": {stage: read_curves(run, stage) for stage in STAGES},
        "pairs_trained": {s: getattr(config, s).steps * getattr(config, s).batch for s in STAGES},
    }


def train_stage(config: TrainingConfig, stage: str, run: Path, data: Path) -> None:
    """To the last step of the schedule, from the checkpoint where there is one."""
    checkpoint = run / f"{stage}.pt"
    if checkpoint.exists():
        step = read_checkpoint(checkpoint)["step"]
        if step >= getattr(config, stage).steps:
            return
    shapes = load_shapes(data, "train", points=config.data.surface_points or None)
    StageTrainer(config, stage, shapes, run).run(progress=False)


def load_variant(checkpoint: Path, config: TrainingConfig, name: str) -> RegistrationNetwork:
    """The variant's weights, averaged or not, in evaluation mode."""
    variant = VARIANTS[name]
    state = read_checkpoint(checkpoint)
    switches: NetworkConfig = replace(config.network, weighted_centroids=variant.weighted_centroids)
    network = RegistrationNetwork(switches)
    network.load_state_dict(state["ema" if variant.averaged else "network"])
    return network.eval()


def recalls(pairs: Sequence[Pair], register: Register) -> dict[str, Any]:
    """Of the coarse and of the final pose: plain recall at the paper's limits, median errors."""
    poses = [register(pair) for pair in pairs]
    truth = np.stack([pair.T_target_source for pair in pairs])
    return {
        name: _figures(np.stack([getattr(p, name) for p in poses]), truth)
        for name in ("coarse", "fine")
    }


def _figures(poses: Float64, truth: Float64) -> dict[str, Any]:
    rotation = rotation_error_deg(poses, truth)
    found = share(within(rotation, translation_error(poses, truth), LIMITS[0]))
    # A pair without a pose is as far off as can be.
    return found | {"median_deg": float(np.median(np.nan_to_num(rotation, nan=180.0)))}


def trained_pairs(run: Path, stage: str) -> int:
    """How many pairs a stage's checkpoint has seen."""
    state = read_checkpoint(run / f"{stage}.pt")
    return int(state["step"] * state["config"][stage]["batch"])


def read_curves(run: Path, stage: str) -> dict[str, list[list[float]]]:
    """Of each figure of a stage's training, about CURVE_POINTS means as [last step, mean].

    Up to the checkpoint: a run that was stopped has logged more than its weights have seen.
    """
    last = read_checkpoint(run / f"{stage}.pt")["step"]
    events = EventAccumulator(str(run / "tensorboard" / stage), size_guidance={"scalars": 0})
    events.Reload()
    known = events.Tags()["scalars"]
    curves = {}
    for name in CURVES[stage]:
        # Runs of the first version have no groups.
        logged = events.Scalars(f"train/{name}" if f"train/{name}" in known else name)
        points = [point for point in logged if point.step <= last]
        parts = np.array_split(np.arange(len(points)), min(CURVE_POINTS, len(points)))
        curves[name] = [
            [points[part[-1]].step, float(np.mean([points[i].value for i in part]))]
            for part in parts
        ]
    return curves
