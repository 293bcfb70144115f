"""Fixtures of the data tests: the built furniture test split, and small shape sets."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from vnreg_train.data.build import build_furniture
from vnreg_train.data.shapes import ShapeSet

settings.register_profile("data", deadline=None, max_examples=50)
settings.load_profile("data")
ROOT = Path(__file__).resolve().parents[3]


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "furniture: uses the built furniture test split in VNREG_FURNITURE or data/furniture; "
        "skipped where it is absent, or built (with the network) if VNREG_FURNITURE_BUILD is set",
    )


@pytest.fixture(scope="session")
def furniture_folder() -> Path:
    folder = Path(os.environ.get("VNREG_FURNITURE", ROOT / "data" / "furniture"))
    if os.environ.get("VNREG_FURNITURE_BUILD"):
        build_furniture(folder, folder / "cache", ("test",), occupancy=False)
    if not (folder / "test.h5").exists():
        pytest.skip(f"{folder}/test.h5 is not built")
    return folder


@pytest.fixture(scope="session")
def random_shapes() -> ShapeSet:
    """Five clouds of 4,096 points on ellipsoids of longest side 1, with queries."""
    rng = np.random.default_rng(5)
    unit = rng.normal(size=(5, 4096, 3))
    unit /= np.linalg.norm(unit, axis=2, keepdims=True)
    axes = np.array([0.5, 0.4, 0.3]) * np.ones((5, 1, 3))
    queries = rng.uniform(-0.55, 0.55, (5, 512, 3))
    return ShapeSet(
        surface=(unit * axes).astype(np.float32),
        label=np.array([0, 1, 2, 1, 0]),
        names=tuple("abcde"),
        categories=("one", "two", "three"),
        queries=queries.astype(np.float32),
        occupancies=((queries / axes) ** 2).sum(axis=2).__lt__(1).astype(np.uint8),
    )
