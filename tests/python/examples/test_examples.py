"""The examples in Python run and say what they should."""

from __future__ import annotations

import filecmp
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import vnreg
from vnreg_train.networks.descriptor import DescriptorNetwork
from vnreg_train.networks.descriptor_config import DescriptorConfig

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


def run(folder: Path, script: Path, *arguments: str | Path) -> str:
    """What the script prints, run in `folder` with the module under test."""
    environment = os.environ | {"PYTHONPATH": str(Path(vnreg.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, script, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_scans_are_what_their_script_writes(tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "data" / "make_mug.py", tmp_path)
    run(tmp_path, tmp_path / "make_mug.py")
    for name in ("mug_1.xyz", "mug_2.xyz"):
        assert filecmp.cmp(tmp_path / name, EXAMPLES / "data" / name, shallow=False)


def test_06_notebook(tmp_path: Path) -> None:
    output = run(tmp_path, EXAMPLES / "06_notebook.py")
    assert "status='ok'" in output
    rows = re.findall(r"\[+ *(-?[\d.]+) +(-?[\d.]+) +(-?[\d.]+) +(-?[\d.]+)", output)
    expected = [[0.36, 0.48, -0.80, 0.7], [-0.80, 0.60, 0.00, -0.2], [0.48, 0.64, 0.60, 1.1]]
    np.testing.assert_allclose(np.array(rows[:3], float), expected, atol=0.06)
    assert float(re.findall(r"confidence ([\d.]+)", output)[0]) > 0.5
    assert (tmp_path / "06_notebook.png").stat().st_size > 10_000


def test_07_own_checkpoint(tmp_path: Path) -> None:
    torch.manual_seed(3)
    config = DescriptorConfig()
    checkpoint = {
        "config": {"arch": "vnreg", "name": "any", "network": config.to_dict()},
        "ema": DescriptorNetwork(config).state_dict(),
    }
    torch.save(checkpoint, tmp_path / "vnreg.pt")
    output = run(tmp_path, EXAMPLES / "07_own_checkpoint.py", "vnreg.pt", "--out", "mine.vnr")
    assert "vnreg.Model(name='mine', points=1024)" in output
    assert "confidence=nan" in output
    assert vnreg.Model.load(tmp_path / "mine.vnr").name == "mine"


def test_09_many_machines(tmp_path: Path) -> None:
    script = EXAMPLES / "09_many_machines.py"
    output = run(tmp_path, script, "--pairs", "12")
    assert "done now: {'ok': 12, 'unreadable': 1}; parts done before: 0" in output
    assert "sure of 12 of 13 pairs" in output
    assert re.search(r"pair 12: .*mug_3.xyz: expected a file that can be read", output)
    assert "parts done before: 2" in run(tmp_path, script, "--pairs", "12")


@pytest.mark.parametrize("library", ["small_gicp", "open3d"])
def test_08_icp_hand_over(library: str, tmp_path: Path) -> None:
    pytest.importorskip(library, reason="only `make evaluate` installs the peers")
    output = run(tmp_path, EXAMPLES / "08_icp_hand_over.py", "--with", library)
    before, after = (float(angle) for angle in re.findall(r"off by ([\d.]+) degrees", output))
    assert before < 5
    assert after < 0.2
    assert after < before
