"""Clouds from files, by the readers of the program."""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np
import pytest

import vnreg

POINTS = np.array([[0.1, -2.0, 3e-7], [4.0, np.nan, 5.0]])
ROWS = "0.1 -2 3e-7\n4 nan 5\n"


def npy_bytes() -> bytes:
    file = io.BytesIO()
    np.save(file, POINTS)
    return file.getvalue()


@pytest.mark.parametrize(
    ("content", "name"),
    [
        (npy_bytes(), ""),
        (ROWS.encode(), ""),
        (ROWS.encode(), "scan.TXT"),
        (b"x,y,z\n" + ROWS.replace(" ", ",").encode(), "scan.csv"),
        (
            b"ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\n"
            b"property double z\nend_header\n" + ROWS.encode(),
            "",
        ),
    ],
)
def test_points_are_those_written(content: bytes, name: str) -> None:
    points = vnreg.parse_cloud(content, name)
    assert points.dtype == np.float64 and points.shape == (2, 3)
    np.testing.assert_array_equal(points, POINTS)


def test_a_cloud_without_points() -> None:
    content = b"ply\nformat ascii 1.0\nelement vertex 0\n"
    content += b"".join(b"property float %c\n" % axis for axis in b"xyz") + b"end_header\n"
    assert vnreg.parse_cloud(content).shape == (0, 3)


def test_a_broken_file_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="^expected a point cloud, found an empty file$"):
        vnreg.parse_cloud(b"")
    with pytest.raises(ValueError, match="^line 2: expected "):
        vnreg.parse_cloud(b"1 2 3\n4 5\n")
    with pytest.raises(TypeError):
        vnreg.parse_cloud("1 2 3\n")  # type: ignore[arg-type]  # text, not bytes


def test_read_cloud_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "scan.xyz"
    path.write_text(ROWS)
    np.testing.assert_array_equal(vnreg.read_cloud(path), POINTS)
    np.testing.assert_array_equal(vnreg.read_cloud(str(path)), POINTS)
    path.write_text("1 2 3\n4 5\n")
    with pytest.raises(ValueError, match=f"^{path}: line 2: expected "):
        vnreg.read_cloud(path)
    with pytest.raises(FileNotFoundError):
        vnreg.read_cloud(tmp_path / "none.ply")


def test_names_that_are_not_utf_8(tmp_path: Path) -> None:
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9.npy"))
    path.write_bytes(npy_bytes())
    np.testing.assert_array_equal(vnreg.read_cloud(path), POINTS)
