"""Every format, written by something else than the program, comes back point by point."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from cli_clouds import WRITERS, read_back
from cli_program import Program
from hypothesis import given, settings
from hypothesis import strategies as st


@pytest.mark.parametrize("name", WRITERS)
@settings(max_examples=6, deadline=None)
@given(
    count=st.integers(24, 200),
    scale=st.sampled_from([1e-3, 1.0, 1e4]),
    seed=st.integers(0, 2**32 - 1),
)
def test_points_come_back(
    vnreg: Program, model: Path, name: str, count: int, scale: float, seed: int
) -> None:
    random = np.random.default_rng(seed)
    # Few decimals, so that the compressed format compresses and no writer's rounding shows.
    points = np.round(random.uniform(-1, 1, (count, 3)) * [1, 0.7, 0.4], 2) * scale
    tolerance = 1e-6 * scale if "f4" in name or "trimesh" in name else 1e-12 * scale
    with tempfile.TemporaryDirectory() as folder:
        file_name, write = WRITERS[name]
        path = Path(folder) / file_name
        write(path, points)
        found = read_back(vnreg, model, path)
    assert found.shape == points.shape
    assert np.abs(found - points).max() <= tolerance


def test_a_compressed_cloud_is_really_compressed(tmp_path: Path) -> None:
    points = np.zeros((1000, 3))
    file_name, write = WRITERS["pcd compressed"]
    write(tmp_path / file_name, points)
    assert (tmp_path / file_name).stat().st_size < 2000
