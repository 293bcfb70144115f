"""More points and iterations with the same weights, and budgets read off a curve."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import h5py
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "training"))

from tiny_run import bent_boxes, tiny_config

from vnreg_train.evaluate.bars import LIMIT
from vnreg_train.evaluate.run import Pairing
from vnreg_train.export.model import export_model
from vnreg_train.paper.extrapolate import SPEED, budget_table, points_per_doubling
from vnreg_train.paper.iterations import measure_iterations
from vnreg_train.paper.speed import random_network


@pytest.fixture
def pairing(tmp_path: Path) -> Pairing:
    boxes = bent_boxes(2, points=4096)
    with h5py.File(tmp_path / "validation.h5", "w") as file:
        file["data"], file["label"] = boxes.surface, boxes.label[:, None]
        file["names"] = list(boxes.names)
    return Pairing("validation", data=tmp_path)


def test_choices_share_their_coarse_poses_and_differ_in_time(
    pairing: Pairing, tmp_path: Path
) -> None:
    model = tmp_path / "model.vnr"
    export_model(random_network(tiny_config().network), model, "iterations")
    found = measure_iterations(model, pairing, [1, 2, 3], [(6, 1), (2, 16)])
    assert found["pairs"] == 6 and set(found["coarse"]) == {
        "clean",
        "noisy",
        "independent",
        "partial",
    }
    assert all(0 <= of["within_30_deg"] <= 1 for of in found["coarse"].values())
    none, many = found["lines"]
    assert (none["keep_divisor"], many["iterations"]) == (6, 16)
    assert all(of["pairs"] == 6 for of in many["recall"].values())
    assert many["ms"] > none["ms"]


def test_a_budget_doubles_for_every_slope_that_is_missing() -> None:
    curve = [[100, 0.9], [200, 0.0], [400, 0.1], [800, 0.2]]
    assert math.isclose(points_per_doubling(curve), 10.0)

    def row(recall: float) -> dict[str, object]:
        return {"paper": {"plain": {LIMIT: {"recall": recall}}}}

    recalls = {"clean": 1.0, "noisy": 0.85, "independent": 0.6, "partial": 0.61}
    figures = {
        "curve": {"curves": {"coarse": {"recall": curve}}, "pairs": {"coarse": 12_800}},
        "recall": {"rows": {f"P0/{name}/180": row(of) for name, of in recalls.items()}},
        "training_speed": {"recipes": {SPEED: {"pairs_per_second": 64.0}}},
    }
    lines = [line.split("|")[1:-1] for line in budget_table(figures).splitlines()[2:]]
    cells = [[cell.strip() for cell in line] for line in lines]
    # 800 steps of 16 pairs, doubled once and twice.
    assert cells == [
        ["noisy", "85.0", "95", "1.0", "26,000", "0.1"],
        ["independent", "60.0", "80", "2.0", "51,000", "0.2"],
    ]
