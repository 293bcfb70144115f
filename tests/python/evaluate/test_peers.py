"""The peers: their grids, their tuning, and that each of them can register an easy pair."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vnreg_train.data.protocol import rotation_error_deg
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.evaluate import tune
from vnreg_train.evaluate.pairs import row_pairs
from vnreg_train.evaluate.peers import PEERS, TUNED
from vnreg_train.evaluate.rows import ROWS
from vnreg_train.evaluate.run import Pairing


def test_grids_are_products_without_repetition() -> None:
    for peer in PEERS.values():
        points = [tuple(settings.values()) for settings in peer.settings()]
        assert len(set(points)) == len(points)
        assert len(points) == np.prod([len(values) for values in peer.grid.values()])
        assert 4 <= len(points) <= 16


def test_the_chosen_settings_are_the_best_of_the_grid() -> None:
    content = json.loads(TUNED.read_text(encoding="utf-8"))
    assert content["split"] == "validation"
    for name, peer in PEERS.items():
        entry = content["peers"][name]
        tried_settings = [tried["settings"] for tried in entry["tried"]]
        assert all(settings in tried_settings for settings in peer.settings())
        best = max(tried["mean_recall"] for tried in entry["tried"])
        assert entry["mean_recall"] == best
        assert any(
            tried["settings"] == entry["chosen"] and tried["mean_recall"] == best
            for tried in entry["tried"]
        )


def test_tuning_prefers_recall_then_time(
    data_folder: Path, known_method: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    class Peer(known_method):  # type: ignore[misc]  # a base chosen at run time
        def __init__(self, name: str, settings: dict[str, Any]) -> None:
            right = {"ICP": 1, "PLANE_ICP": 4, "GICP": 4}[settings["kind"]]
            super().__init__({index: 0.0 for index in range(right)})
            self.slow = settings["kind"] == "PLANE_ICP"

        def estimate(self, pair: Any) -> Any:
            estimate = super().estimate(pair)
            object.__setattr__(estimate, "ms", 9.0 if self.slow else 5.0)
            return estimate

    monkeypatch.setattr(tune, "PeerMethod", Peer)
    out = tmp_path / "tuned.json"
    out.write_text('{"peers": {"other": 1}}', encoding="utf-8")
    pairing = Pairing("validation", data=data_folder)
    tune.tune_peers(["small_gicp"], pairing, {}, out)
    monkeypatch.setattr(tune, "PeerMethod", None)  # all is known now
    tune.tune_peers(["small_gicp"], pairing, {}, out)
    content = json.loads(out.read_text(encoding="utf-8"))
    assert content["peers"]["other"] == 1
    entry = content["peers"]["small_gicp"]
    assert entry["chosen"]["kind"] == "GICP"
    assert entry["mean_recall"] == pytest.approx(4 / 6)
    assert len(entry["tried"]) == len(list(PEERS["small_gicp"].settings()))


@pytest.mark.parametrize("name", list(PEERS))
def test_a_peer_registers_an_easy_pair_the_right_way_round(shapes: ShapeSet, name: str) -> None:
    """The same points a few degrees apart, a distance that a refinement alone can go."""
    for package in PEERS[name].packages:
        pytest.importorskip(
            {"open3d-cpu": "open3d", "kiss-matcher": "kiss_matcher"}.get(package, package),
            reason="only `make evaluate` installs the peers (requirements/evaluate.txt)",
        )
    from vnreg_train.evaluate.peers import tuned_peer

    peer = tuned_peer(name)
    pair = next(iter(row_pairs(shapes, ROWS["P0/clean/45"], [3])))
    turn = np.eye(4)
    turn[:3, :3] = [[np.cos(0.1), -np.sin(0.1), 0], [np.sin(0.1), np.cos(0.1), 0], [0, 0, 1]]
    turn[:3, 3] = [0.01, -0.02, 0.015]
    target = (pair.source @ turn[:3, :3].T + turn[:3, 3]).astype(np.float32)
    easy = type(pair)(**{**vars(pair), "target": target, "T_target_source": turn})
    estimate = peer.estimate(easy)
    assert estimate.T_target_source is not None and estimate.ms > 0
    assert rotation_error_deg(estimate.T_target_source, turn) < 0.5
    np.testing.assert_allclose(estimate.T_target_source[:3, 3], turn[:3, 3], atol=5e-3)
    again = peer.estimate(easy)
    # To rounding: on several threads, which a test may use, their ICP adds in another order.
    np.testing.assert_allclose(again.T_target_source, estimate.T_target_source, rtol=0, atol=1e-12)
