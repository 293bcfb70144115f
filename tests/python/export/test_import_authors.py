"""Checkpoints in the layout of the paper's authors: what their weights mean here, and refusals."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

sys.path.insert(0, str(Path(__file__).parent))

from authors_network import AuthorsNetwork, authors_network

import vnreg
from vnreg_train.cli import parser
from vnreg_train.export.import_authors import (
    AuthorsCheckpointError,
    from_state_dict,
    import_authors,
)

State = dict[str, Tensor]


def clouds() -> list[np.ndarray]:
    rng = np.random.default_rng(3)
    direction = rng.normal(size=(2, 150, 3))
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    surface = direction * (1 + 0.4 * np.sin(4 * direction[..., :1] + 1)) * [0.4, 0.3, 0.2]
    return [surface[0] + [0.3, 0.1, -0.2], surface[1][:140] @ np.diag([1.0, -1.0, -1.0])]


def save(network: AuthorsNetwork, path: Path) -> Path:
    """As their trainer does: the whole network, and parts of it once more."""
    part = network.feature_extractor.global_module.state_dict()
    torch.save({"epoch": 3, "model": network.state_dict(), "global_feature_module": part}, path)
    return path


def run_command(*words: str) -> None:
    arguments = parser().parse_args(["import-authors", *words])
    arguments.run_command(arguments)


def assert_near(found: np.ndarray, expected: Tensor) -> None:
    wanted = expected.detach().numpy()
    assert found.shape == wanted.shape
    assert np.abs(found - wanted).max() < 2e-5 * max(1.0, np.abs(wanted).max())


@pytest.mark.parametrize("shared", [False, True])
def test_the_engine_computes_what_the_authors_network_computes(
    tmp_path: Path, shared: bool
) -> None:
    network = authors_network(shared=shared)
    out = tmp_path / "authors.vnr"
    run_command(str(save(network, tmp_path / "theirs.pth")), "--out", str(out))
    model = vnreg.Model.load(out)
    registrar = vnreg.Registrar(model, mode="paper", record_stages=True)
    registrar.align(*clouds())
    stages = registrar.stages()
    features = {}
    for side, cloud in zip(("source", "target"), clouds(), strict=True):
        centred = (cloud - cloud.mean(0)).astype(np.float32)
        with torch.no_grad():
            feature, descriptors = network.features(torch.from_numpy(centred.T)[None])
            significance = network.fine_register.sig_fc(descriptors)[0, 0]
        features[side] = descriptors
        assert_near(stages[f"{side}.global"], feature[0])
        assert_near(stages[f"{side}.descriptor"], descriptors[0].T)
        assert_near(stages[f"{side}.significance"], significance)
    assert_near(stages["fine.0.similarity"], similarity(network, stages, features))


def similarity(
    network: AuthorsNetwork, stages: dict[str, np.ndarray], features: dict[str, Tensor]
) -> Tensor:
    """The first iteration's, of the points that the engine kept and moved by its coarse pose."""
    points, kept = {}, {}
    for side in ("source", "target"):
        kept[side] = torch.from_numpy(stages[f"{side}.kept"].astype(np.int64))
        points[side] = stages[f"{side}.points"].astype(np.float32)
    coarse = stages["coarse.T"]
    points["source"] = points["source"] @ coarse[:3, :3].T + coarse[:3, 3]
    x, y = (torch.from_numpy(points[side].astype(np.float32).T)[None] for side in points)
    one, other = (features[side][..., kept[side]] for side in ("source", "target"))
    with torch.no_grad():
        kept_points = x[..., kept["source"]], y[..., kept["target"]]
        return network.fine_register.similarity(*kept_points, one, other)[0]


def test_constants_of_their_code_are_in_the_model(tmp_path: Path) -> None:
    config = import_authors(save(authors_network(), tmp_path / "theirs.pth")).network.config
    assert (config.neighbours, config.keep_divisor, config.fine_iterations) == (20, 6, 3)
    assert config.input_rms_radius == 0.0 and not config.shared_direction
    assert (config.global_channels, config.local_channels) == (8, 12)
    assert (config.descriptor_channels, config.pair_channels) == (10, 6)
    assert config.significance_channels == (9, 7)


def test_a_bare_state_dict_will_do(tmp_path: Path) -> None:
    state = authors_network().state_dict()
    torch.save(state, tmp_path / "bare.pth")
    weight = import_authors(tmp_path / "bare.pth").network.state_dict()
    theirs = state["feature_extractor.local_module.conv_local.weight"]
    assert torch.equal(weight["extractor.local_module.descriptor.weight"], theirs[..., 0])


def test_a_checkpoint_of_the_coarse_stage_gives_mode_coarse(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = authors_network().state_dict()
    coarse = {k: v for k, v in state.items() if "local_module" not in k and "fine_" not in k}
    torch.save({"model": coarse}, tmp_path / "coarse.pth")
    run_command(str(tmp_path / "coarse.pth"), "--out", str(tmp_path / "coarse.vnr"))
    assert "mode coarse only" in capsys.readouterr().out
    model = vnreg.Model.load(tmp_path / "coarse.vnr")
    assert vnreg.align(*clouds(), model=model, mode="coarse").has_pose


def without(name: str) -> Callable[[State], None]:
    def change(state: State) -> None:
        del state[name]

    return change


def put(name: str, value: Tensor) -> Callable[[State], None]:
    return lambda state: state.update({name: value})


PAIR = "fine_register.sim_feat_conv.conv.0.conv.weight"
BLOCK = "feature_extractor.global_module.vn_network_1.blocks.1"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (without(f"{BLOCK}.fc0.map_to_feat.weight"), f"missing tensors: {BLOCK}.fc0.map_to_feat"),
        (without("feature_extractor.global_module.fc_global.map_to_feat.weight"), "fc_global"),
        (without("fine_register.sig_fc.conv.1.bn.running_var"), "sig_fc.conv.1.bn.running_var"),
        (put(f"{BLOCK}.fc2.weight", torch.ones(3)), f"does not have: {BLOCK}.fc2.weight"),
        (put(PAIR, torch.ones(6, 23, 1, 1)), r"expected shape \(6, 24\), got \(6, 23, 1, 1\)"),
        (put(PAIR, torch.ones(6, 24, 3, 1)), r"expected shape \(6, 24\), got \(6, 24, 3, 1\)"),
        (put(PAIR, torch.full((6, 24, 1, 1), float("nan"))), "finite"),
        (
            put("feature_extractor.global_module.fc_global.map_to_feat.weight", torch.ones(8)),
            "expected a matrix",
        ),
    ],
)
def test_another_layout_is_refused_by_name(change: Callable[[State], None], message: str) -> None:
    state = dict(authors_network().state_dict())
    change(state)
    with pytest.raises(AuthorsCheckpointError, match=message):
        from_state_dict(state)


def test_files_of_another_kind_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "not.pth"
    path.write_bytes(b"not a checkpoint")
    with pytest.raises(AuthorsCheckpointError, match="not a torch checkpoint"):
        import_authors(path)
    torch.save({"model": [1, 2]}, path)
    with pytest.raises(AuthorsCheckpointError, match="state dict"):
        import_authors(path)
    with pytest.raises(SystemExit, match="import-authors"):
        run_command(str(tmp_path / "none.pth"), "--out", str(tmp_path / "none.vnr"))
