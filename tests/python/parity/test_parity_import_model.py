"""A model file read back into torch: nothing is lost, and what is not a model is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from parity_pairs import make_test_pair, normalised_error
from parity_twin import CONFIGS, Twin

from vnreg_train.export.import_model import import_model
from vnreg_train.export.model import export_model
from vnreg_train.export.reference import Reference
from vnreg_train.model_file import ModelFileError, read_model, write_model


@pytest.mark.parametrize("name", ["shipped", *CONFIGS])
def test_export_of_an_import_gives_the_same_bytes(
    name: str, twin: Callable[[str], Twin], tmp_path: Path
) -> None:
    path = twin(name).path
    network, metadata = import_model(path)
    extra = {k: v for k, v in metadata.items() if k.startswith(("calibration.", "provenance."))}
    export_model(
        network, tmp_path / "again.vnr", str(metadata["name"]), int(metadata["input.points"]), extra
    )
    assert (tmp_path / "again.vnr").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("name", ["small", "identity-shortcut", "narrow"])
def test_an_imported_network_computes_what_the_exported_one_does(
    name: str, twin: Callable[[str], Twin]
) -> None:
    """In float64, where folding the batch norms costs only the rounding of the file's float32."""
    original = twin(name)
    network, _ = import_model(original.path)
    pair = make_test_pair(1, 100, 80, noisy=True)
    actual = Reference(network, torch.float64).register(pair.source, pair.target)
    expected = original.exact(pair.source, pair.target)
    for stage in ("network0.block2", "global", "network2.block1", "descriptor", "significance"):
        assert normalised_error(actual[f"source.{stage}"], expected[f"source.{stage}"]) < 3e-5, (
            stage
        )


def test_every_tensor_of_the_file_arrives(twin: Callable[[str], Twin], tmp_path: Path) -> None:
    """Changing any one tensor of the file changes exactly that tensor of the re-export."""
    metadata, tensors = read_model(twin("narrow").path)
    for name in tensors:
        changed = tensors | {name: tensors[name] + np.float32(0.5)}
        write_model(tmp_path / "changed.vnr", metadata, changed)
        network, _ = import_model(tmp_path / "changed.vnr")
        export_model(network, tmp_path / "again.vnr", "narrow")
        _, again = read_model(tmp_path / "again.vnr")
        different = [key for key in tensors if not np.array_equal(again[key], tensors[key])]
        assert different == [name]


def test_other_architectures_and_tensors_are_refused(
    twin: Callable[[str], Twin], tmp_path: Path
) -> None:
    metadata, tensors = read_model(twin("narrow").path)
    path = tmp_path / "x.vnr"
    write_model(path, metadata | {"arch": "golden"}, tensors)
    with pytest.raises(ValueError, match='"arch": expected paper or vnreg, got golden'):
        import_model(path)
    write_model(path, metadata, {k: v for k, v in tensors.items() if k != "encoder.pre"})
    with pytest.raises(ValueError, match='"encoder.pre": expected f32 of shape'):
        import_model(path)
    write_model(path, metadata, tensors | {"encoder.more": tensors["encoder.pre"]})
    with pytest.raises(ValueError, match='"encoder.more": expected only the tensors'):
        import_model(path)
    write_model(path, metadata, tensors | {"encoder.pre": tensors["encoder.pre"].T.copy()})
    with pytest.raises(ValueError, match=r'"encoder.pre" shape: expected \(16, 3\), got \(3, 16\)'):
        import_model(path)
    path.write_bytes(b"ply\n")
    with pytest.raises(ModelFileError, match="magic"):
        import_model(path)
