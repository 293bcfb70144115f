"""The models under comparison, and what both programs make of pairs of clouds."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from parity_pairs import make_test_pair
from parity_run import Run
from parity_twin import CONFIGS, ROOT, Twin
from random_network import random_network

from vnreg_train.data.shapes import ShapeSet, load_shapes
from vnreg_train.export.import_model import import_model
from vnreg_train.export.model import export_model


@pytest.fixture(scope="session")
def shipped_path() -> Path:
    """The shipped model, or the one that the environment variable VNREG_MODEL names."""
    path = Path(os.environ.get("VNREG_MODEL", ROOT / "models" / "small.vnr"))
    assert path.is_file(), f"no model at {path}"
    return path


@pytest.fixture(scope="session")
def twin(shipped_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Twin]:
    """Twins by name: 'shipped', or random weights of one of CONFIGS; made once."""
    folder = tmp_path_factory.mktemp("models")
    made: dict[str, Twin] = {}

    def get(name: str) -> Twin:
        if name not in made:
            if name == "shipped":
                made[name] = Twin(name, import_model(shipped_path)[0], shipped_path)
            else:
                network = random_network(CONFIGS[name], seed=11)
                export_model(network, folder / f"{name}.vnr", name)
                made[name] = Twin(name, network, folder / f"{name}.vnr")
        return made[name]

    return get


@pytest.fixture(scope="session")
def run(twin: Callable[[str], Twin]) -> Callable[..., Run]:
    """Runs by model, sizes, noise and seed, each computed once and shared by the tests."""
    made: dict[tuple[str, int, int, bool, int], Run] = {}

    def get(name: str, sizes: tuple[int, int], noisy: bool, seed: int = 1) -> Run:
        key = (name, *sizes, noisy, seed)
        if key not in made:
            made[key] = Run(twin(name), make_test_pair(seed, *sizes, noisy))
        return made[key]

    return get


@pytest.fixture(scope="session")
def furniture_test() -> ShapeSet:
    """The test split of the furniture set; built, which needs the network, where it is absent."""
    from vnreg_train.data.build import build_furniture

    folder = Path(os.environ.get("VNREG_FURNITURE", ROOT / "data" / "furniture"))
    build_furniture(folder, folder / "cache", ("test",), occupancy=False)
    return load_shapes(folder, "test", queries=0)
