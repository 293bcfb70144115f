"""The engine's modes as methods that answer pairs."""

from __future__ import annotations

import hashlib
import time
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np

import vnreg
import vnreg._vnreg
from vnreg_train.data.protocol import Pair
from vnreg_train.evaluate.estimates import Estimate

Mode = Literal["coarse", "paper", "verified"]
MODES: tuple[Mode, ...] = ("coarse", "paper", "verified")


class Method(Protocol):
    """Answers pairs, on one thread."""

    @property
    def name(self) -> str:
        """Of the method's folder in a run, and of its column."""

    def identity(self) -> dict[str, Any]:
        """All that its answers depend on: answers of another identity are not reused."""

    def estimate(self, pair: Pair) -> Estimate:
        """Never raises for a pair that it cannot register."""


class EngineMethod:
    """A mode of the engine with a model file, or with the built-in model."""

    def __init__(self, mode: Mode, model: Path | None) -> None:
        self.mode, self._path = mode, model
        loaded = vnreg.Model.load(model) if model else vnreg.Model.builtin()
        self.model_name = loaded.name
        self._registrar = vnreg.Registrar(loaded, mode=mode, threads=1)

    @property
    def name(self) -> str:
        return self.mode

    def identity(self) -> dict[str, Any]:
        """Digests of the compiled engine and of the model file."""
        return {
            "mode": self.mode,
            "engine_version": vnreg.__version__,
            "engine_sha256": _digest(Path(str(vnreg._vnreg.__file__))),
            "instruction_set": vnreg.instruction_set(),
            "model": self.model_name,
            "model_sha256": _digest(self._path) if self._path else "built in",
        }

    def estimate(self, pair: Pair) -> Estimate:
        start = time.process_time()
        result = self._registrar.align(pair.source, pair.target)
        ms = 1000 * (time.process_time() - start)
        return Estimate(
            T_target_source=result.T_target_source if result.has_pose else None,
            ms=ms,
            status=result.status,
            confidence=result.confidence,
            evidence=_evidence(result, self.mode),
            covariance=result.covariance if np.isfinite(result.covariance).all() else None,
            alternatives=tuple(a.T_target_source for a in result.alternatives),
        )


def _evidence(result: vnreg.Result, mode: str) -> dict[str, float]:
    """What the confidence of the mode is computed from, by the names of its model-file keys."""
    if mode == "verified":
        return result.evidence
    near = result.inlier_distance
    return {"overlap": result.overlap, "residual": result.rmse / near if near > 0 else 0.0}


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]
