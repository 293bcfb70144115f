"""What the program says when it cannot: one line on stderr, nothing on stdout, the right code."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cli_program import FAILURE, INPUT, USAGE, Program
from numpy.typing import NDArray

from vnreg_train.model_file import read_model, write_model

Points = NDArray[np.float64]


@pytest.fixture()
def good(shape: Points, tmp_path: Path) -> Path:
    np.save(tmp_path / "good.npy", shape)
    return tmp_path / "good.npy"


@pytest.mark.parametrize("json", [[], ["--json"]])
@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("empty.ply", b"", "expected a point cloud, found an empty file"),
        (
            "mesh.stl",
            b"solid cube\n",
            (
                "expected a point cloud as PLY, PCD, OBJ, OFF, XYZ, TXT, CSV or NPY, "
                "found a file that begins 'solid cube\\x0a'"
            ),
        ),
        (
            "cut.ply",
            b"ply\nformat ascii 1.0\n",
            "line 2: expected 'end_header', found the end of the file",
        ),
        ("bad.xyz", b"1 2 3\n4 five 6\n", "line 2: expected a number in column 2, found 'five'"),
        (
            "huge.pcd",
            (
                b"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n"
                b"WIDTH 1000000000000000000\nDATA binary\nabc"
            ),
            (
                "byte 85: expected 12000000000000000000 bytes of points, "
                "found 3 bytes up to the end of the file"
            ),
        ),
        ("few.csv", b"1,2,3\n4,5,6\n", "expected at least 24 points, found 2"),
        ("equal.csv", b"1,2,3\n" * 100, "expected points that differ, found 100 equal points"),
        (
            "nan.csv",
            b"".join(b"%d,%d,3\n" % (i, i * i) for i in range(50)) + b"1,nan,3\n",
            "point 51: expected finite coordinates, found 1 nan 3",
        ),
        (
            "inf.csv",
            b"-inf,1,3\n" + b"".join(b"%d,%d,3\n" % (i, i * i) for i in range(50)),
            "point 1: expected finite coordinates, found -inf 1 3",
        ),
    ],
)
def test_bad_clouds(
    vnreg: Program,
    model: Path,
    good: Path,
    tmp_path: Path,
    name: str,
    content: bytes,
    message: str,
    json: list[str],
) -> None:
    bad = tmp_path / name
    bad.write_bytes(content)
    expected = f"{bad}: {message}"
    output = tmp_path / "out.ply"
    arguments = ("--model", model, "-o", output, *json)
    assert vnreg("align", bad, good, *arguments).error(INPUT) == expected
    assert vnreg("align", good, bad, *arguments).error(INPUT) == expected
    assert not output.exists()


def test_clouds_that_cannot_be_opened(vnreg: Program, good: Path, tmp_path: Path) -> None:
    missing = tmp_path / "none.ply"
    assert (
        vnreg("align", good, missing).error(INPUT)
        == f"{missing}: expected a file that can be read, found No such file or directory"
    )
    assert (
        vnreg("align", good, tmp_path).error(INPUT)
        == f"{tmp_path}: expected a file, found a directory"
    )


def test_a_name_with_a_line_end_stays_on_one_line(vnreg: Program, good: Path) -> None:
    assert vnreg("align", "a\nb.ply", good).error(INPUT).startswith("a\\x0ab.ply: expected a file")


def test_points_on_a_line_determine_no_rotation_or_give_one(
    vnreg: Program, model: Path, good: Path, tmp_path: Path
) -> None:
    line = tmp_path / "line.npy"
    np.save(line, np.outer(np.linspace(0, 1, 60), [1.0, 2.0, 3.0]))
    run = vnreg("align", line, good, "--model", model, "--json")
    if run.code == INPUT:
        assert "expected clouds that determine a rotation" in run.error(INPUT)
    else:
        assert np.isfinite(np.array(run.json()["T_target_source"])).all()


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["frobnicate"],
        ["align"],
        ["align", "a.ply"],
        ["align", "a.ply", "b.ply", "--frobnicate"],
        ["align", "a.ply", "b.ply", "--mode", "fine"],
        ["align", "a.ply", "b.ply", "--threads", "-1"],
        ["align", "a.ply", "b.ply", "--threads", "many"],
        ["align", "a.ply", "b.ply", "--max-points", "16385"],
        ["align", "a.ply", "b.ply", "--seed=-1"],
        ["align", "a.ply", "b.ply", "--seed", "18446744073709551616"],
        ["align", "a.ply", "b.ply", "--model"],
        ["align", "a.ply", "b.ply", "-o", "moved.xyz"],
        ["info"],
        ["info", "a.vnr", "b.vnr"],
        ["selftest", "a.vnr"],
    ],
)
def test_usage(vnreg: Program, arguments: list[str]) -> None:
    assert vnreg(*arguments).error(USAGE).endswith("(see vnreg --help)")


def test_an_option_out_of_the_range_of_the_library(vnreg: Program, model: Path, good: Path) -> None:
    run = vnreg("align", good, good, "--model", model, "--max-points", "10")
    assert "max_points" in run.error(USAGE)


def broken_models(model: Path, folder: Path) -> dict[str, str]:
    """Files that are no usable model, and what the message must hold."""
    content = model.read_bytes()
    (folder / "cut.vnr").write_bytes(content[:-1])
    (folder / "changed.vnr").write_bytes(
        content[:-100] + bytes([content[-100] ^ 1]) + content[-99:]
    )
    (folder / "text.vnr").write_text("no model\n")
    (folder / "empty.vnr").write_bytes(b"")
    (folder / "newer.vnr").write_bytes(content[:8] + b"\x02" + content[9:])
    metadata, tensors = read_model(model)
    write_model(
        folder / "lacking.vnr", metadata, {k: v for k, v in tensors.items() if k != "encoder.pre"}
    )
    write_model(folder / "other.vnr", metadata | {"arch": "other"}, tensors)
    return {
        "cut.vnr": "file size",
        "changed.vnr": "checksum",
        "text.vnr": "magic",
        "empty.vnr": "expected",
        "newer.vnr": "version",
        "lacking.vnr": "encoder.pre",
        "other.vnr": "arch",
        "none.vnr": "No such file or directory",
    }


def test_bad_models(vnreg: Program, model: Path, good: Path, tmp_path: Path) -> None:
    for name, part in broken_models(model, tmp_path).items():
        message = vnreg("align", good, good, "--model", tmp_path / name).error(INPUT)
        assert message.startswith(f"{tmp_path / name}: ") and part in message
        assert "expected" in message and "found" in message
        if name in ("lacking.vnr", "other.vnr"):
            continue  # valid containers, which `info` shows
        assert vnreg("info", tmp_path / name).error(INPUT).startswith(f"{tmp_path / name}: ")


def test_output_that_cannot_be_written(
    vnreg: Program, model: Path, good: Path, tmp_path: Path
) -> None:
    output = tmp_path / "none" / "moved.ply"
    assert (
        vnreg("align", good, good, "--model", model, "-o", output).error(FAILURE)
        == f"{output}: expected a folder that can be written to, found No such file or directory"
    )


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_standard_output_that_is_full(program_path: Path, model: Path) -> None:
    with open("/dev/full", "wb") as full:
        run = subprocess.run(
            [program_path, "info", model],
            stdout=full,
            stderr=subprocess.PIPE,
            timeout=60,
            check=False,
        )
    assert run.returncode == FAILURE
    assert run.stderr == b"vnreg: standard output: expected room, found none\n"
