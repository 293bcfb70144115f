"""The ablation: what its lines change, that each is trained once and measured, and by what."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "training"))

from tiny_run import bent_boxes, tiny_config, trainer

from vnreg_train.evaluate.run import Pairing
from vnreg_train.paper import ablation
from vnreg_train.paper.page import ADDITIONS, TABLE_V
from vnreg_train.paper.registrations import make_register, runs_in_engine
from vnreg_train.paper.variants import BASE, VARIANTS, variant_config
from vnreg_train.training.config import TrainingConfig, load_config

SHAPES = 4


@pytest.fixture(scope="module")
def pairing(tmp_path_factory: pytest.TempPathFactory) -> Pairing:
    """Training and validation shapes of 4,096 points."""
    folder = tmp_path_factory.mktemp("shapes")
    boxes = bent_boxes(SHAPES, points=4096)
    for split in ("train", "validation"):
        with h5py.File(folder / f"{split}.h5", "w") as file:
            file["data"] = boxes.surface
            file["label"] = boxes.label[:, None]
            file["names"] = [f"{split}-{k}" for k in range(SHAPES)]
    return Pairing("validation", data=folder)


def short_config() -> TrainingConfig:
    config = replace(tiny_config(), validation_steps=0, log_steps=2)
    stages = {s: replace(getattr(config, s), steps=25, batch=2) for s in ("coarse", "fine")}
    return replace(config, **stages)


def test_lines_differ_in_what_they_say() -> None:
    base = load_config("ablation")
    plain = asdict(variant_config(base, BASE))
    for name, variant in VARIANTS.items():
        found = asdict(variant_config(base, name))
        changed = {
            (section, key): value
            for section in ("network", "data", "coarse", "fine")
            for key, value in found[section].items()
            if value != plain[section][key]
        }
        wanted = {(s, k): v for s, keys in variant.changes.items() for k, v in keys.items()}
        assert changed == wanted, name
    assert set(VARIANTS) == {*TABLE_V, *ADDITIONS}


@pytest.mark.parametrize("name", ["neither", "vectors", "both", "last_weights"])
def test_a_line_is_trained_and_measured_once(name: str, pairing: Pairing, tmp_path: Path) -> None:
    results = ablation.run_ablation(short_config(), tmp_path, pairing, [name])
    of = results[name]
    assert of["engine"] == (name != "neither")
    assert of["pairs_trained"] == {"coarse": 50, "fine": 50}
    assert all(of["recall"][k]["pairs"] == SHAPES for k in ("coarse", "fine"))
    assert [curve[-1][0] for curve in of["curves"]["fine"].values()] == [24, 24]
    written = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.*")}
    assert ablation.run_ablation(short_config(), tmp_path, pairing, [name]) == results
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.*")} == written
    longer = replace(short_config(), seed=1)
    path = tmp_path / name / "result.json"
    identity = json.loads(path.read_text(encoding="utf-8"))["identity"]
    assert identity != ablation._identity(longer, name, pairing)


def test_engine_and_reference_agree_where_both_can(pairing: Pairing, tmp_path: Path) -> None:
    """The torch path, which lines without vector neurons take, gives the engine's poses."""
    config = short_config()
    ablation.run_ablation(config, tmp_path, pairing, [BASE])
    network = ablation.load_variant(tmp_path / BASE / "fine.pt", config, BASE)
    other = ablation.load_variant(tmp_path / BASE / "fine.pt", config, "plain_centroids")
    assert runs_in_engine(network) and not runs_in_engine(other)
    by_engine = make_register(network, tmp_path / "m.vnr")
    by_torch = make_register(other, tmp_path / "none.vnr")
    for pair in list(pairing.pairs(ablation.ROW))[:2]:
        one, two = by_engine(pair), by_torch(pair)
        assert np.abs(one.coarse - two.coarse).max() < 1e-3
        assert not np.array_equal(one.fine, two.fine)
    assert not (tmp_path / "none.vnr").exists()


def test_a_curve_ends_where_its_checkpoint_does(tmp_path: Path) -> None:
    """A run that was stopped has logged steps that its weights have not seen."""
    run = trainer(tmp_path, "coarse", replace(tiny_config(), validation_steps=0, log_steps=2))
    run.run(progress=False)
    run.step = 6
    run.save()
    curves = ablation.read_curves(tmp_path, "coarse")
    assert {points[-1][0] for points in curves.values()} == {6}
