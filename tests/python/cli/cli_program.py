"""What a run of the program gives, and the checks that every run must pass."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

repository = Path(__file__).resolve().parents[3]

OK, FAILURE, USAGE, INPUT, NOT_SURE = 0, 1, 2, 3, 4


@dataclass
class Run:
    """Exit code and both outputs."""

    code: int
    stdout: str
    stderr: str

    def json(self) -> dict[str, Any]:
        """The object on stdout; a NaN or Infinity, which is no JSON, fails."""

        def refuse(name: str) -> None:
            raise AssertionError(f"{name} is not JSON")

        assert self.stderr == ""
        value = json.loads(self.stdout, parse_constant=refuse)
        assert isinstance(value, dict)
        return value

    def error(self, code: int) -> str:
        """The message, without `vnreg: `: one line on stderr, nothing on stdout."""
        assert (self.code, self.stdout) == (code, ""), self
        assert self.stderr.startswith("vnreg: ") and self.stderr.endswith("\n"), self
        assert self.stderr.count("\n") == 1, self
        return self.stderr.removeprefix("vnreg: ").removesuffix("\n")


Program = Callable[..., Run]


def random_pose(seed: int, shift: float = 0.5) -> NDArray[np.float64]:
    """A rotation drawn uniformly, and a translation within `shift`."""
    random = np.random.default_rng(seed)
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    pose = np.eye(4)
    pose[:3, :3] = q * np.linalg.det(q)
    pose[:3, 3] = random.uniform(-shift, shift, 3)
    return pose


def moved(pose: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4), (N, 3) -> (N, 3)."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3], dtype=np.float64)


def rotation_error_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """The angle between two rotations; accurate for small angles, unlike the arc cosine."""
    chord = np.linalg.norm(a[:3, :3] - b[:3, :3]) / math.sqrt(8)
    return math.degrees(2 * math.asin(min(1.0, float(chord))))
