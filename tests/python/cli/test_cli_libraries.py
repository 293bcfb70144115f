"""Files written by other libraries come back point by point."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_clouds import read_back
from cli_libraries import LIBRARIES, open3d_writers, write_open3d
from cli_program import Program, repository
from numpy.typing import NDArray

Points = NDArray[np.float64]
PCL = repository / "tests" / "data" / "cloud_file"
TOLERANCE = 1e-6


def some_points() -> Points:
    """Few decimals and much repetition: compressed files are compressed, and text is exact."""
    points = np.round(np.random.default_rng(3).uniform(-1, 1, (96, 3)) * [1, 0.7, 0.4], 2)
    points[:, 2] = np.round(np.arange(96) / 200, 1) + 0.25 * points[:, 2].round(1)
    return points


def check_read(vnreg: Program, model: Path, path: Path, points: Points) -> None:
    found = read_back(vnreg, model, path)
    assert found.shape == points.shape
    assert np.abs(found - points).max() <= TOLERANCE


@pytest.mark.parametrize("name", LIBRARIES)
def test_a_file_of_another_library(vnreg: Program, model: Path, name: str, tmp_path: Path) -> None:
    file_name, write = LIBRARIES[name]
    write(tmp_path / file_name, some_points())
    check_read(vnreg, model, tmp_path / file_name, some_points())


@pytest.fixture(scope="module")
def open3d() -> Any:
    """Of requirements/evaluate.txt: too large for every installation."""
    return pytest.importorskip("open3d", reason="only `make evaluate` installs the peers")


@pytest.mark.parametrize(("name", "file_name", "options"), list(open3d_writers()))
def test_a_file_of_open3d(
    vnreg: Program,
    model: Path,
    open3d: Any,
    tmp_path: Path,
    name: str,
    file_name: str,
    options: dict[str, bool],
) -> None:
    write_open3d(open3d, tmp_path / file_name, some_points(), options)
    check_read(vnreg, model, tmp_path / file_name, some_points())


@pytest.mark.parametrize("path", sorted(PCL.glob("pcl_*")), ids=lambda path: path.name)
def test_a_file_of_pcl(vnreg: Program, model: Path, path: Path) -> None:
    """Written by Debian's pcl-tools 1.13 from tests/data/cloud_file/points.xyz; see make_pcl.sh."""
    check_read(vnreg, model, path, np.loadtxt(PCL / "points.xyz"))


def test_there_are_files_of_pcl() -> None:
    assert len(list(PCL.glob("pcl_*"))) >= 6
