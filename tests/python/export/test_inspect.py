"""`vnreg-train inspect` on the shipped models, on golden files and on a checkpoint."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from vnreg_train.cli import parser
from vnreg_train.export.inspect import InspectError, inspection
from vnreg_train.model_file import read_model, write_model

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "training"))

import tiny_run
from test_descriptor_train import train_steps, trainer

MODELS = Path(__file__).resolve().parents[3] / "models"


def test_a_shipped_model_is_told_whole(capsys: pytest.CaptureFixture[str]) -> None:
    path = MODELS / "vnreg.vnr"
    arguments = parser().parse_args(["inspect", str(path)])
    arguments.run_command(arguments)
    text = capsys.readouterr().out
    metadata, tensors = read_model(path)
    for name, tensor in tensors.items():
        line = re.search(rf"^  {re.escape(name)} .*$", text, re.M)
        assert line, name
        numbers = line[0].split()
        assert numbers[-4] == str(tensor.size)
        assert float(numbers[-3]) == pytest.approx(np.linalg.norm(tensor.astype(float)), rel=1e-3)
        assert float(numbers[-1]) == pytest.approx(np.abs(tensor).max(), rel=1e-2)
        assert " x ".join(map(str, tensor.shape)) in line[0]
    assert f"{path.stat().st_size:,} bytes" in text
    assert "complete: every tensor" in text
    assert f"judge: {metadata['channels.judge']} hidden channels, 6,529 numbers" in text
    assert re.search(rf"^  margin +{metadata['calibration.verified.margin']:.6g}$", text, re.M)
    assert "golden.vnr, of this model" in text and "128 points and 120 points" in text
    assert "card" in text and "trained on" in text and "Apache-2.0" in text


def test_the_paper_s_model_has_no_judge() -> None:
    text = inspection(MODELS / "small.vnr")
    assert "judge: none" in text and "architecture  paper, complete" in text
    assert "golden.vnr, of this model" in text


def test_what_is_missing_or_of_another_model_is_said(tmp_path: Path) -> None:
    metadata, tensors = read_model(MODELS / "vnreg.vnr")
    kept = {k: v for k, v in metadata.items() if not k.startswith(("calibration.", "provenance."))}
    path = tmp_path / "mine.vnr"
    write_model(path, kept, tensors | {"lengths": tensors["lengths"] * 2})
    text = inspection(path)
    for words in ("calibration: none", "provenance: none", "card: none", "golden file: none"):
        assert words in text
    shutil.copy(MODELS / "vnreg.golden.vnr", tmp_path / "mine.golden.vnr")
    assert "OF ANOTHER MODEL" in inspection(path)
    write_model(path, kept, {k: v for k, v in tensors.items() if k != "lengths"})
    assert "which the engine refuses" in inspection(path)


def test_a_golden_file_tells_its_model_and_its_stages() -> None:
    text = inspection(MODELS / "vnreg.golden.vnr")
    assert "128 points and 120 points" in text and "stage.source.descriptor.local" in text


def test_a_checkpoint_tells_where_its_run_stands(tmp_path: Path) -> None:
    run = trainer(tmp_path)
    train_steps(run, 3)
    run.save()
    text = inspection(run.checkpoint)
    assert re.search(r"^  step +3 of 8$", text, re.M)
    assert re.search(r"^  optimisation.batch +4$", text, re.M)
    weight = run.average.module.local_descriptor.weight
    line = re.search(r"^  local_descriptor.weight .*$", text, re.M)
    assert line and float(line[0].split()[-3]) == pytest.approx(float(weight.norm()), rel=1e-3)
    distance = re.search(r"last to averaged +(\S+)", text)
    assert distance and float(distance[1]) > 0


def test_the_statistics_of_batch_norms_are_no_weights(tmp_path: Path) -> None:
    for stage in ("coarse", "fine"):
        run = tiny_run.trainer(tmp_path, stage)
        tiny_run.train_steps(run, 2)
        run.save()
    own, average = (
        torch.nn.utils.parameters_to_vector(network.parameters())
        for network in (run.network, run.average.module)
    )
    distance = re.search(r"last to averaged +(\S+)", inspection(run.checkpoint))
    assert distance and float(distance[1]) == pytest.approx(float((own - average).norm()), rel=1e-3)


def test_other_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.vnr").write_bytes(b"something else")
    (tmp_path / "a.pt").write_bytes(b"something else")
    torch.save({"stage": "fine"}, tmp_path / "half.pt")
    for name in ("a.vnr", "a.pt", "half.pt"):
        with pytest.raises(InspectError, match=name):
            inspection(tmp_path / name)
