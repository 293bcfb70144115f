"""The fit of the confidence, its place in the model file, and that the engine computes the same."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shipped import SHIPPED

import vnreg
from vnreg_train.data.protocol import make_pair
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.evaluate import calibrate
from vnreg_train.evaluate.calibrate import (
    Calibration,
    Sample,
    calibrate_model,
    collect_sample,
    fit_calibration,
    write_calibrated,
)
from vnreg_train.evaluate.confidence import sigmoid
from vnreg_train.evaluate.run import Pairing
from vnreg_train.model_file import read_model


def made(mode: str, **weights: float) -> Calibration:
    return Calibration(mode, -2.0, weights, 10, 0.5, 0.9, 0.1, 0.9, 0.1)


def test_a_fit_ranks_and_is_calibrated_on_other_shapes_too() -> None:
    rng = np.random.default_rng(0)
    evidence = rng.uniform(0, 1, (4000, 2)) * [1.0, 0.3]
    right = rng.uniform(size=4000) < sigmoid(-6 + evidence @ [12.0, -4.0])
    found = fit_calibration(
        Sample(("fit", "gap"), evidence, right, rng.integers(0, 80, 4000), rng.chisquare(6, 4000)),
        "verified",
        factor=2.0,
    )
    assert found.bias == pytest.approx(-6, rel=0.2)
    assert found.weights["fit"] == pytest.approx(12, rel=0.2)
    assert found.pairs == 4000 and found.right_share == right.mean()
    assert 0.85 < found.held_out_auroc <= found.auroc
    assert found.ece < 0.03 and found.held_out_ece < 0.04
    assert list(found.metadata()) == [
        "calibration.verified.bias",
        "calibration.verified.fit",
        "calibration.verified.gap",
        "calibration.verified.covariance",
    ]
    assert found.covariance == pytest.approx(2, rel=0.05)  # it was right already


def test_every_row_and_seed_is_a_part_of_the_sample(
    data_folder: Path, known_method: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(calibrate.ROWS, "verified", ("P1/density", "P0/clean/45"))
    method = known_method({0: 0.0, 1: 1.0, 2: 30.0, 3: 0.0})
    sample = collect_sample(
        method, "verified", Pairing("validation", data=data_folder), [4, 5, 6], {}
    )
    assert method.calls == 2 * 3 * 6
    assert sample.names == ("fit",)
    assert sample.right.shape == (2 * 3 * 4,)  # two shapes get no pose
    np.testing.assert_array_equal(sample.right.reshape(6, 4), [[1, 1, 0, 1]] * 6)
    np.testing.assert_array_equal(sample.evidence[:4, 0], [0.8, 0.8, 0.1, 0.8])
    np.testing.assert_array_equal(sample.shape[:4], [0, 1, 2, 3])
    np.testing.assert_array_equal(np.isnan(sample.nees[:12]), [1] * 12)  # P0 comes first
    np.testing.assert_array_equal(np.isnan(sample.nees[12:16]), [0, 0, 1, 0])


def test_a_method_without_evidence_cannot_be_calibrated(
    data_folder: Path, known_method: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(calibrate.ROWS, "verified", ("P1/density",))
    method = known_method({0: 0.0})
    told = method.estimate

    def silent(pair: Any) -> Any:
        estimate = told(pair)
        estimate.evidence.clear()
        return estimate

    method.estimate = silent
    with pytest.raises(ValueError, match="no evidence in mode verified"):
        collect_sample(method, "verified", Pairing("validation", data=data_folder), [0], {})


def test_calibrating_one_mode_leaves_all_else(tmp_path: Path) -> None:
    metadata, tensors = read_model(SHIPPED)
    assert "calibration.overlap" in metadata
    path = tmp_path / "model.vnr"
    write_calibrated(SHIPPED, path, made("verified", old=1.0, fit=2.0))
    write_calibrated(path, path, made("verified", fit=3.0))
    after, same = read_model(path)
    added = {key: value for key, value in after.items() if key not in metadata}
    assert added == {"calibration.verified.bias": -2.0, "calibration.verified.fit": 3.0}
    assert {key: after[key] for key in metadata} == metadata
    for name, tensor in tensors.items():
        np.testing.assert_array_equal(same[name], tensor)
    write_calibrated(path, path, made("paper", overlap=4.0, residual=5.0))
    paper, _ = read_model(path)
    assert paper["calibration.overlap"] == 4.0
    assert paper["calibration.verified.fit"] == 3.0


def test_the_engine_computes_the_same_confidence(shapes: ShapeSet, tmp_path: Path) -> None:
    calibration = made("paper", overlap=5.0, residual=-3.0)
    write_calibrated(SHIPPED, tmp_path / "calibrated.vnr", calibration)
    model = vnreg.Model.load(tmp_path / "calibrated.vnr")
    statuses: set[str] = set()
    for index in range(len(shapes)):
        for setting in ("clean", "partial_independent_noisy"):
            pair = make_pair(shapes, index, setting, 180.0)
            result = vnreg.align(pair.source, pair.target, model=model, mode="paper")
            expected = calibration.confidence(
                {"overlap": result.overlap, "residual": result.rmse / result.inlier_distance}
            )
            assert result.confidence == pytest.approx(expected, rel=1e-12)
            assert (result.status == "low_confidence") == (result.confidence < 0.5)
            statuses.add(result.status)
    assert statuses == {"ok", "low_confidence"}


def test_a_model_is_calibrated_on_the_pairs_of_its_mode(
    data_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(calibrate.ROWS, "paper", ("P0/clean/45", "P0/independent/180"))
    pairing = Pairing("validation", data=data_folder)
    calibration = calibrate_model(SHIPPED, "paper", pairing, [1, 2], {})
    assert calibration.pairs == 2 * 2 * 6
    assert 0 < calibration.right_share < 1
    assert calibration.auroc > 0.9  # clean pairs fit, the others do not
    assert set(calibration.weights) == {"overlap", "residual"}
