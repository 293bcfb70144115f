"""What more points and more iterations of the fine register bring, with the same weights."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vnreg_train.data.mesh import Float64
from vnreg_train.data.protocol import Pair, rotation_error_deg, translation_error
from vnreg_train.evaluate.measures import share
from vnreg_train.evaluate.rows import ROWS
from vnreg_train.evaluate.run import Pairing
from vnreg_train.evaluate.scores import LIMITS, within
from vnreg_train.model_file import read_model, write_model
from vnreg_train.paper.registrations import Poses, engine_register

SETTINGS = ("clean", "noisy", "independent", "partial")
# (keep divisor, iterations); the first are the paper's.
CHOICES = ((6, 3), (6, 6), (6, 16), (3, 3), (3, 10), (3, 16))
BEFORE_REFINING = (CHOICES[0], CHOICES[2])
NEAR_DEG = 30.0


def measure_iterations(
    model: Path,
    pairing: Pairing,
    seeds: Sequence[int],
    choices: Sequence[tuple[int, int]] = CHOICES,
) -> dict[str, Any]:
    """Recall of every choice, and how near coarse poses are: P0 at 180 degrees, by the engine."""
    pairs = {setting: _pairs(pairing, setting, seeds) for setting in SETTINGS}
    lines = [_line(model, pairs, *choice) for choice in choices]
    return {
        "split": pairing.split,
        "seeds": list(seeds),
        "pairs": len(pairs[SETTINGS[0]]),
        "coarse": lines[0]["coarse"],
        "lines": [{k: v for k, v in line.items() if k != "coarse"} for line in lines],
    }


def _pairs(pairing: Pairing, setting: str, seeds: Sequence[int]) -> list[Pair]:
    row = ROWS[f"P0/{setting}/180"]
    return [pair for seed in seeds for pair in replace(pairing, seed=seed).pairs(row)]


def _line(
    model: Path, pairs: dict[str, list[Pair]], divisor: int, iterations: int
) -> dict[str, Any]:
    metadata, tensors = read_model(model)
    metadata |= {"fine.keep_divisor": divisor, "fine.iterations": iterations}
    recall, coarse = {}, {}
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.vnr"
        write_model(path, metadata, tensors)
        register = engine_register(path)
        for setting, of in pairs.items():
            poses = [register(pair) for pair in of]
            recall[setting] = _recall(of, poses)
            coarse[setting] = _coarse(of, poses)
    count = sum(map(len, pairs.values()))
    return {
        "keep_divisor": divisor,
        "iterations": iterations,
        "recall": recall,
        "coarse": coarse,
        "ms": 1e3 * (time.process_time() - start) / count,
    }


def _truth(pairs: Sequence[Pair]) -> Float64:
    return np.stack([pair.T_target_source for pair in pairs])


def _recall(pairs: Sequence[Pair], poses: Sequence[Poses]) -> dict[str, Any]:
    """Share within the paper's limits; a pair without a pose is lost."""
    fine, truth = np.stack([pose.fine for pose in poses]), _truth(pairs)
    errors = rotation_error_deg(fine, truth), translation_error(fine, truth)
    return share(within(*errors, LIMITS[0]))


def _coarse(pairs: Sequence[Pair], poses: Sequence[Poses]) -> dict[str, float]:
    angles = rotation_error_deg(np.stack([pose.coarse for pose in poses]), _truth(pairs))
    angles = np.nan_to_num(angles, nan=180.0)
    near = float((angles < NEAR_DEG).mean())
    return {f"within_{NEAR_DEG:g}_deg": near, "median_deg": float(np.median(angles))}
