"""Pairs through the engine: what came out, beside the truth."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

import vnreg
from vnreg_train.data.protocol import Pair, make_pair, rotation_error_deg, translation_error
from vnreg_train.data.shapes import ShapeSet

Mode = Literal["coarse", "paper", "verified"]
MAX_ROTATION_DEG = 5.0
MAX_TRANSLATION = 0.2


@dataclass(frozen=True)
class Outcomes:
    """One entry per pair, all arrays of shape (N,). Errors are NaN where there was no pose."""

    coarse_rotation_deg: NDArray[np.float64]
    coarse_translation: NDArray[np.float64]
    rotation_deg: NDArray[np.float64]
    translation: NDArray[np.float64]
    overlap: NDArray[np.float64]
    relative_residual: NDArray[np.float64]  # rmse / inlier_distance, 0 without inliers
    confidence: NDArray[np.float64]  # NaN where the model is not calibrated
    same_crop: NDArray[np.int8]  # 1: cropped towards the same side, 0: not, -1: does not apply
    ms: NDArray[np.float64]  # total of one align call

    def __len__(self) -> int:
        return len(self.rotation_deg)

    @property
    def success(self) -> NDArray[np.bool_]:
        """Rotation error below 5 degrees and translation error below 0.2 (paper, section IV)."""
        return successes(self.rotation_deg, self.translation)

    @property
    def coarse_success(self) -> NDArray[np.bool_]:
        """As `success`, of the coarse register alone."""
        return successes(self.coarse_rotation_deg, self.coarse_translation)


def successes(
    rotation_deg: NDArray[np.float64], translation: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Which pairs count as registered; NaN does not."""
    return np.asarray((rotation_deg < MAX_ROTATION_DEG) & (translation < MAX_TRANSLATION))


def concatenated(parts: Sequence[Outcomes]) -> Outcomes:
    """Outcomes one after another."""
    names = [field.name for field in fields(Outcomes)]
    return Outcomes(**{n: np.concatenate([getattr(part, n) for part in parts]) for n in names})


class Evaluator:
    """Runs pairs through the engine, on several threads at once (the engine releases the GIL).

    Every pair is aligned by one engine thread, so that the figures do not depend on `threads`.
    """

    def __init__(self, model: vnreg.Model, mode: Mode = "paper", threads: int = 2) -> None:
        self._model, self._mode, self._threads = model, mode, threads
        self._local = threading.local()

    @staticmethod
    def load(path: Path, mode: Mode = "paper", threads: int = 2) -> Evaluator:
        """Of a model file. Raises vnreg.Error."""
        return Evaluator(vnreg.Model.load(path), mode, threads)

    def run(
        self,
        shapes: ShapeSet,
        setting: str,
        max_angle_deg: float,
        protocol: str = "P0",
        seed: int = 0,
        indices: Sequence[int] | None = None,
    ) -> Outcomes:
        """One pair per shape (of `indices`, default all), as `vnreg_train.data.protocol` has it."""
        chosen = range(len(shapes)) if indices is None else indices

        def make(index: int) -> Pair:
            return make_pair(shapes, index, setting, max_angle_deg, protocol, seed)

        return self.align(make, chosen)

    def align(self, make: Callable[[int], Pair], indices: Sequence[int]) -> Outcomes:
        """The pairs make(index), in the order of the indices; at least one."""
        if len(indices) == 0:
            raise ValueError("expected at least one pair, got none")
        with ThreadPoolExecutor(self._threads) as pool:
            rows = list(pool.map(lambda index: self._one(make(index)), indices))
        columns = [np.array(column) for column in zip(*rows, strict=True)]
        names = [field.name for field in fields(Outcomes)]
        outcomes = dict(zip(names, columns, strict=True))
        outcomes["same_crop"] = outcomes["same_crop"].astype(np.int8)
        return Outcomes(**outcomes)

    def _one(self, pair: Pair) -> tuple[float, ...]:
        if not hasattr(self._local, "registrar"):
            self._local.registrar = vnreg.Registrar(self._model, mode=self._mode, threads=1)
        registrar: vnreg.Registrar = self._local.registrar
        result = registrar.align(pair.source, pair.target)
        truth = pair.T_target_source
        pose, coarse = result.T_target_source, result.T_target_source_coarse
        near = result.inlier_distance
        return (
            float(rotation_error_deg(coarse, truth)),
            float(translation_error(coarse, truth)),
            float(rotation_error_deg(pose, truth)),
            float(translation_error(pose, truth)),
            result.overlap,
            result.rmse / near if near > 0 else 0.0,
            result.confidence,
            -1 if pair.same_crop is None else int(pair.same_crop),
            result.ms["total"],
        )
