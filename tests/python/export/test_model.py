"""From checkpoint to model file: deterministic, complete, and faithful to the network."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

sys.path.insert(0, str(Path(__file__).parent.parent / "training"))

from tiny_run import tiny_config, train_steps, trainer

from vnreg_train.cli import parser
from vnreg_train.export.checkpoint import golden_of_checkpoint
from vnreg_train.export.import_model import import_model
from vnreg_train.export.model import (
    config_from_metadata,
    export_golden,
    export_model,
    load_checkpoint,
)
from vnreg_train.export.tensors import engine_tensors, folded_batch_norm
from vnreg_train.model_file import read_model
from vnreg_train.networks.registration import RegistrationNetwork


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    for stage in ("coarse", "fine"):
        run = trainer(folder, stage)
        train_steps(run, 3)
        run.save()
    return folder / "fine.pt"


def test_a_re_export_is_byte_equal(checkpoint: Path, tmp_path: Path) -> None:
    for name in ("a.vnr", "b.vnr"):
        network, config = load_checkpoint(checkpoint)
        export_model(network, tmp_path / name, config["name"], 128, {"provenance.data": "boxes"})
    assert (tmp_path / "a.vnr").read_bytes() == (tmp_path / "b.vnr").read_bytes()


def test_the_file_says_what_the_network_is(checkpoint: Path, tmp_path: Path) -> None:
    network, _ = load_checkpoint(checkpoint)
    export_model(network, tmp_path / "m.vnr", "tiny", 128)
    metadata, tensors = read_model(tmp_path / "m.vnr")
    again = config_from_metadata(metadata)
    unsaid = {"decoder_width": network.config.decoder_width}  # not part of the engine
    assert replace(again, **unsaid) == network.config
    assert metadata["name"] == "tiny" and metadata["input.points"] == 128
    for name, value in engine_tensors(network).items():
        assert np.array_equal(tensors[name], value), name


def test_the_average_is_exported_not_the_last_weights(checkpoint: Path) -> None:
    state = torch.load(checkpoint, weights_only=True)
    network, _ = load_checkpoint(checkpoint)
    name = "extractor.local_module.descriptor.weight"
    assert torch.equal(network.state_dict()[name], state["ema"][name])
    assert not torch.equal(state["ema"][name], state["network"][name])


def test_folded_batch_norm_equals_batch_norm() -> None:
    bn = torch.nn.BatchNorm1d(5).double().eval()
    assert bn.running_mean is not None and bn.running_var is not None
    bn.running_mean.uniform_(-1, 1)
    bn.running_var.uniform_(0.1, 2)
    torch.nn.init.uniform_(bn.weight)
    torch.nn.init.uniform_(bn.bias)
    x = torch.randn(7, 5, dtype=torch.float64)
    scale, shift = folded_batch_norm(bn)
    assert torch.allclose(bn(x), x * scale + shift)


def test_the_fine_register_may_be_set_otherwise(checkpoint: Path, tmp_path: Path) -> None:
    words = ["export", str(checkpoint), str(tmp_path / "longer.vnr")]
    arguments = parser().parse_args([*words, "--fine-iterations", "7", "--keep-divisor", "2"])
    arguments.run_command(arguments)
    metadata, _ = read_model(tmp_path / "longer.vnr")
    assert (metadata["fine.iterations"], metadata["fine.keep_divisor"]) == (7, 2)


def test_a_network_without_vector_neurons_is_not_exported() -> None:
    network = RegistrationNetwork(replace(tiny_config().network, vector_neurons=False))
    with pytest.raises(ValueError, match="vector_neurons"):
        engine_tensors(network)


@pytest.mark.parametrize("switch", ["invariant_layer", "shared_encoder"])
def test_the_other_ablations_come_back_as_they_were(switch: str, tmp_path: Path) -> None:
    config = replace(tiny_config().network, **{switch: False})
    network = RegistrationNetwork(config).eval()
    export_model(network, tmp_path / "ablation.vnr", "ablation")
    again, metadata = import_model(tmp_path / "ablation.vnr")
    assert metadata[f"ablation.{switch}"] is False
    assert not getattr(again.config, switch)
    for name, tensor in engine_tensors(network).items():
        assert np.array_equal(tensor, engine_tensors(again)[name]), name


def test_a_golden_file_holds_inputs_and_every_stage(checkpoint: Path, tmp_path: Path) -> None:
    network, _ = load_checkpoint(checkpoint)
    export_model(network, tmp_path / "m.vnr", "tiny", 128)
    rng = np.random.default_rng(0)
    source, target = rng.normal(size=(100, 3)), rng.normal(size=(90, 3))
    export_golden(network, tmp_path / "m.vnr", tmp_path / "g.vnr", source, target)
    metadata, tensors = read_model(tmp_path / "g.vnr")
    assert metadata["arch"] == "golden"
    assert np.array_equal(tensors["input.source"], source)
    assert tensors["stage.source.network0.block2"].shape == (100, 8, 3)
    assert tensors["stage.target.kept"].dtype == np.int32
    assert tensors["stage.fine.2.T"].shape == (4, 4)
    assert tensors["stage.fine.0.similarity"].shape == (16, 15)


def test_a_golden_file_follows_the_settings_of_the_model_file(
    checkpoint: Path, tmp_path: Path
) -> None:
    """Exported to match more points more often than the network was trained to."""
    model, golden = tmp_path / "m.vnr", tmp_path / "g.vnr"
    words = ["export", str(checkpoint), str(model), "--keep-divisor", "3", "--fine-iterations", "5"]
    arguments = parser().parse_args(words)
    arguments.run_command(arguments)
    rng = np.random.default_rng(0)
    golden_of_checkpoint(checkpoint, model, golden, *rng.normal(size=(2, 90, 3)))
    _, tensors = read_model(golden)
    assert len(tensors["stage.source.kept"]) == 30
    assert "stage.fine.4.T" in tensors and "stage.fine.5.T" not in tensors
