"""`vnreg-train train` from its words to checkpoint and curves."""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

sys.path.insert(0, str(Path(__file__).parent))

from tiny_run import bent_boxes

from vnreg_train.cli import parser

CONFIG = """
arch = "vnreg"
name = "tiny"
compile = false
log_steps = 2
validation_steps = 2
validation_shapes = 3
[network]
channels = 8
scalars = 8
gates = 2
products = 2
global_channels = 8
[data]
points = 48
encoded = 24
mixture = { clean = 1.0 }
[optimisation]
steps = 4
batch = 2
[optimisation.weights]
match = 1.0
match_local = 0.4
match_context = 0.2
significance = 0.15
overlap = 0.1
frames_local = 0.2
frames_context = 0.2
global = 0.1
"""


def write_shapes(folder: Path, split: str, count: int) -> None:
    shapes = bent_boxes(count)
    with h5py.File(folder / f"{split}.h5", "w") as file:
        file["data"] = shapes.surface
        file["label"] = np.zeros((count, 1), np.int64)
        file["names"] = list(shapes.names)


def train(folder: Path) -> set[str]:
    """Trains in the folder; the names of the curves."""
    (folder / "tiny.toml").write_text(CONFIG, encoding="utf-8")
    words = ["train", str(folder / "tiny.toml"), "--data", str(folder), "--quiet"]
    arguments = parser().parse_args([*words, "--run", str(folder / "run")])
    arguments.run_command(arguments)
    assert (folder / "run" / "vnreg.pt").exists()
    events = EventAccumulator(str(folder / "run" / "tensorboard" / "vnreg"))
    events.Reload()
    return set(events.Tags()["scalars"])


def test_a_run_has_curves_of_validation_where_there_are_shapes_for_it(tmp_path: Path) -> None:
    write_shapes(tmp_path, "train", 4)
    write_shapes(tmp_path, "validation", 5)
    names = train(tmp_path)
    assert {"train/loss", "validation/independent/coarse_recall"} <= names


def test_a_run_without_validation_shapes_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_shapes(tmp_path, "train", 4)
    names = train(tmp_path)
    assert "train/loss" in names and not any(name.startswith("validation") for name in names)
    assert "training without validation" in capsys.readouterr().out
