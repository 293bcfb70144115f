"""A few shapes without symmetry, in memory and as a split on disk, and a method of known errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vnreg_train.data.protocol import Pair
from vnreg_train.data.shapes import ShapeSet, load_shapes
from vnreg_train.evaluate.estimates import Estimate

POINTS = 4096


@pytest.fixture(scope="session")
def data_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """validation.h5 and test.h5, six bent ellipsoids each."""
    folder = tmp_path_factory.mktemp("data")
    for split, seed in (("validation", 5), ("test", 6)):
        rng = np.random.default_rng(seed)
        points = rng.normal(size=(6, POINTS, 3))
        points /= np.linalg.norm(points, axis=2, keepdims=True)
        points *= rng.uniform(0.15, 0.5, (6, 1, 3))
        points[..., 2] += points[..., 0] ** 2 + 0.5 * points[..., 1] * points[..., 0]
        with h5py.File(folder / f"{split}.h5", "w") as file:
            file["data"] = (points - points.mean(1, keepdims=True)).astype(np.float32)
            file["label"] = np.zeros((6, 1), np.int64)
            file["names"] = [f"{split}-{letter}" for letter in "abcdef"]
    return folder


@pytest.fixture(scope="session")
def shapes(data_folder: Path) -> ShapeSet:
    return load_shapes(data_folder, "validation", queries=0)


class KnownMethod:
    """Answers the truth turned by as many degrees as it is told, counting its calls."""

    name = "verified"

    def __init__(self, errors_deg: dict[int, float], version: int = 1) -> None:
        self.errors_deg, self.version, self.calls = errors_deg, version, 0

    def identity(self) -> dict[str, Any]:
        return {"model": "known", "version": self.version}

    def estimate(self, pair: Pair) -> Estimate:
        self.calls += 1
        if pair.shape not in self.errors_deg:
            return Estimate(None, 1.0, "degenerate")
        pose = pair.T_target_source.copy()
        turn = Rotation.from_euler("x", self.errors_deg[pair.shape], degrees=True).as_matrix()
        pose[:3, :3] = turn @ pose[:3, :3]
        wrong = self.errors_deg[pair.shape] > 5
        return Estimate(
            pose,
            2.0,
            "ambiguous" if wrong else "ok",
            confidence=0.2 if wrong else 0.9,
            evidence={"fit": 0.1 if wrong else 0.8},
            covariance=np.eye(6),
            alternatives=(pair.T_target_source,),
        )


@pytest.fixture
def known_method() -> type[KnownMethod]:
    return KnownMethod
