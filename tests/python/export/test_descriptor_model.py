"""The network `vnreg` to a model file and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from vnreg_train.export.descriptor_model import (
    descriptor_tensors,
    export_descriptor_model,
    import_descriptor_model,
)
from vnreg_train.model_file import read_model, write_model
from vnreg_train.networks.descriptor import DescriptorNetwork, input_features
from vnreg_train.networks.descriptor_config import DescriptorConfig

CONFIG = DescriptorConfig(
    channels=6, scalars=7, gates=2, local_blocks=1, moment_radii=(0.2, 0.4, 1)
)


@pytest.fixture
def network() -> DescriptorNetwork:
    torch.manual_seed(2)
    made = DescriptorNetwork(CONFIG)
    for buffer in made.buffers():
        buffer.uniform_(0.5, 2.0)
    return made.eval()


def test_a_re_export_is_byte_equal(network: DescriptorNetwork, tmp_path: Path) -> None:
    for name in ("a.vnr", "b.vnr"):
        export_descriptor_model(network, tmp_path / name, "x", extra={"provenance.data": "none"})
    assert (tmp_path / "a.vnr").read_bytes() == (tmp_path / "b.vnr").read_bytes()


def test_the_network_of_the_file_computes_the_same(
    network: DescriptorNetwork, tmp_path: Path
) -> None:
    export_descriptor_model(network, tmp_path / "m.vnr", "x", points=128, encoded=64)
    again, metadata = import_descriptor_model(tmp_path / "m.vnr")
    assert again.config == CONFIG
    assert (metadata["input.points"], metadata["input.encoded"]) == (128, 64)
    points = torch.randn(1, 60, 3)
    inputs = input_features(points, torch.ones(1, 60), 40, CONFIG.moment_radii)
    with torch.no_grad():
        pairs = zip(network(points[:, :40], inputs), again(points[:, :40], inputs), strict=True)
    for expected, actual in pairs:
        torch.testing.assert_close(actual, expected, rtol=1e-4, atol=1e-5)


def test_every_parameter_reaches_the_file(network: DescriptorNetwork) -> None:
    """Changing any parameter or input scale changes some tensor."""
    before = descriptor_tensors(network)
    for name, value in [*network.named_parameters(), *network.named_buffers()]:
        kept = value.detach().clone()
        with torch.no_grad():
            value.add_(0.1)
        after = descriptor_tensors(network)
        assert any(not np.array_equal(after[k], before[k]) for k in before), name
        with torch.no_grad():
            value.copy_(kept)


def test_other_files_are_refused(network: DescriptorNetwork, tmp_path: Path) -> None:
    export_descriptor_model(network, tmp_path / "m.vnr", "x")
    metadata, tensors = read_model(tmp_path / "m.vnr")
    write_model(tmp_path / "other.vnr", metadata | {"arch": "paper"}, tensors)
    with pytest.raises(ValueError, match=r'metadata "channels\.local"'):
        import_descriptor_model(tmp_path / "other.vnr")
    write_model(tmp_path / "more.vnr", metadata, tensors | {"more": tensors["lengths"]})
    with pytest.raises(ValueError, match="more"):
        import_descriptor_model(tmp_path / "more.vnr")
    wrong = tensors | {"lengths": np.ones(3, dtype=np.float32)}
    write_model(tmp_path / "wrong.vnr", metadata, wrong)
    with pytest.raises(ValueError, match="lengths"):
        import_descriptor_model(tmp_path / "wrong.vnr")
