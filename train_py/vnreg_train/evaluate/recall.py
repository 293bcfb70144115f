"""The paper's recall table: settings by angle ranges, by register."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vnreg_train.data.protocol import ANGLES_DEG
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.evaluate.outcomes import Evaluator, Mode, Outcomes, successes
from vnreg_train.export.model import export_model
from vnreg_train.networks.registration import RegistrationNetwork

PAPER_SETTINGS = ("clean", "noisy", "independent", "partial")
# What each mode is scored by; the last one is the pose that the mode returns.
REGISTERS: dict[Mode, tuple[str, ...]] = {
    "coarse": ("coarse",),
    "paper": ("coarse", "fine"),
    "verified": ("verified",),
}


def wilson_interval(hits: int, trials: int, z: float = 1.959964) -> tuple[float, float]:
    """The 95 % interval of a share, in 0..1; never empty, also for 0 or all hits."""
    if not 0 <= hits <= trials or trials == 0:
        raise ValueError(f"expected 0 <= hits <= trials > 0, got {hits} of {trials}")
    share = hits / trials
    middle = share + z * z / (2 * trials)
    spread = z * math.sqrt(share * (1 - share) / trials + z * z / (4 * trials * trials))
    scale = 1 + z * z / trials
    return max(0.0, (middle - spread) / scale), min(1.0, (middle + spread) / scale)


@dataclass(frozen=True)
class Score:
    """Recall of one register on some pairs: share, its 95 % Wilson interval, errors."""

    pairs: int
    hits: int
    median_rotation_deg: float  # a pair without a pose counts as 180 degrees
    median_translation: float  # of the pairs with a pose; NaN where none has one

    @property
    def recall(self) -> float:
        return self.hits / self.pairs

    @property
    def interval(self) -> tuple[float, float]:
        return wilson_interval(self.hits, self.pairs)

    def to_dict(self) -> dict[str, Any]:
        low, high = self.interval
        translation = self.median_translation
        return {
            "pairs": self.pairs,
            "hits": self.hits,
            "recall": self.recall,
            "interval_95": [low, high],
            "median_rotation_deg": self.median_rotation_deg,
            "median_translation": None if math.isnan(translation) else translation,
        }


def score(rotation_deg: NDArray[np.float64], translation: NDArray[np.float64]) -> Score:
    """From the errors (N,) of N >= 1 pairs; NaN where a pair has no pose."""
    known = translation[np.isfinite(translation)]
    return Score(
        pairs=len(rotation_deg),
        hits=int(successes(rotation_deg, translation).sum()),
        median_rotation_deg=float(np.median(np.where(np.isnan(rotation_deg), 180, rotation_deg))),
        median_translation=float(np.median(known)) if known.size else math.nan,
    )


@dataclass(frozen=True)
class Cell:
    """One setting and angle range. same_crop, opposite_crop: the halves of partial, else None."""

    setting: str
    max_angle_deg: float
    scores: dict[str, Score]
    same_crop: dict[str, Score] | None
    opposite_crop: dict[str, Score] | None

    def to_dict(self) -> dict[str, Any]:
        cell: dict[str, Any] = {"setting": self.setting, "max_angle_deg": self.max_angle_deg}
        for name in ("scores", "same_crop", "opposite_crop"):
            scores: dict[str, Score] | None = getattr(self, name)
            if scores is not None:
                cell[name] = {register: part.to_dict() for register, part in scores.items()}
        return cell


def _scores(outcomes: Outcomes, chosen: NDArray[np.bool_] | slice, mode: Mode) -> dict[str, Score]:
    scores = {}
    for register in REGISTERS[mode]:
        errors = (outcomes.rotation_deg, outcomes.translation)
        if register == "coarse":
            errors = (outcomes.coarse_rotation_deg, outcomes.coarse_translation)
        scores[register] = score(errors[0][chosen], errors[1][chosen])
    return scores


def make_cell(setting: str, max_angle_deg: float, outcomes: Outcomes, mode: Mode = "paper") -> Cell:
    """Scores of one cell's outcomes."""
    halves = []
    for half in (1, 0):
        chosen = outcomes.same_crop == half
        halves.append(_scores(outcomes, chosen, mode) if chosen.any() else None)
    return Cell(setting, max_angle_deg, _scores(outcomes, slice(None), mode), halves[0], halves[1])


@dataclass(frozen=True)
class RecallTable:
    """Cells in order, and what they were measured on."""

    model: str
    split: str
    protocol: str
    seed: int
    mode: Mode
    cells: tuple[Cell, ...]
    ms_median: float  # of one align call on one engine thread

    def cell(self, setting: str, max_angle_deg: float) -> Cell:
        """Raises KeyError for a cell that was not measured."""
        for cell in self.cells:
            if cell.setting == setting and cell.max_angle_deg == max_angle_deg:
                return cell
        raise KeyError(f"no cell {setting!r} at {max_angle_deg}")

    @property
    def registers(self) -> tuple[str, ...]:
        return REGISTERS[self.mode]

    def mean_recall(self) -> float:
        """Of the returned poses, over the cells: the figure that model selection goes by."""
        return float(np.mean([cell.scores[self.registers[-1]].recall for cell in self.cells]))

    def to_dict(self) -> dict[str, Any]:
        return {
            "model": self.model,
            "split": self.split,
            "protocol": self.protocol,
            "seed": self.seed,
            "mode": self.mode,
            "ms_median": self.ms_median,
            "cells": [cell.to_dict() for cell in self.cells],
        }


def recall_table(
    evaluator: Evaluator,
    shapes: ShapeSet,
    model: str,
    split: str,
    settings: Sequence[str] = PAPER_SETTINGS,
    angles_deg: Sequence[float] = ANGLES_DEG,
    protocol: str = "P0",
    seed: int = 0,
    mode: Mode = "paper",
    limit: int | None = None,
) -> RecallTable:
    """Measures every cell on all shapes (or the first `limit`)."""
    indices = range(len(shapes))[:limit]
    cells: list[Cell] = []
    ms: list[NDArray[np.float64]] = []
    for setting in settings:
        for angle in angles_deg:
            outcomes = evaluator.run(shapes, setting, angle, protocol, seed, indices)
            cells.append(make_cell(setting, float(angle), outcomes, mode))
            ms.append(outcomes.ms)
    median = float(np.median(np.concatenate(ms)))
    return RecallTable(model, split, protocol, seed, mode, tuple(cells), median)


def evaluate_model(
    path: Path,
    shapes: ShapeSet,
    split: str,
    settings: Sequence[str] = PAPER_SETTINGS,
    angles_deg: Sequence[float] = ANGLES_DEG,
    protocol: str = "P0",
    seed: int = 0,
    mode: Mode = "paper",
    threads: int = 2,
    limit: int | None = None,
) -> RecallTable:
    """The recall table of a model file. Raises vnreg.Error for a file that is no model."""
    evaluator = Evaluator.load(path, mode, threads)
    return recall_table(
        evaluator, shapes, path.name, split, settings, angles_deg, protocol, seed, mode, limit
    )


def evaluate_network(
    network: RegistrationNetwork,
    shapes: ShapeSet,
    split: str = "validation",
    settings: Sequence[str] = PAPER_SETTINGS,
    angles_deg: Sequence[float] = (180,),
    seed: int = 0,
    mode: Mode = "paper",
    threads: int = 2,
    limit: int | None = None,
    points: int = 1024,
) -> RecallTable:
    """The recall of a network in training, exported to a temporary file: for model selection.

    The network itself is left as it is (also its training mode). mode "coarse" while the fine
    register is untrained.
    """
    training = network.training
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "network.vnr"
        try:
            export_model(network.eval(), path, "network", points)
        finally:
            network.train(training)
        return evaluate_model(
            path, shapes, split, settings, angles_deg, "P0", seed, mode, threads, limit
        )


def write_json(table: RecallTable, path: Path) -> None:
    """Creates the folder where needed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(table.to_dict(), indent=1) + "\n", encoding="utf-8")
