"""Help, version, `vnreg info` and `vnreg selftest`."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cli_program import FAILURE, INPUT, OK, Program, repository

from vnreg_train.model_file import read_model, write_model


@pytest.mark.parametrize(
    "command", [[], *([name] for name in ("align", "batch", "bench", "info", "selftest"))]
)
def test_help_gives_an_example(vnreg: Program, command: list[str]) -> None:
    run = vnreg(*command, "--help")
    assert (run.code, run.stderr) == (OK, "")
    assert f"Example: {' '.join(['vnreg', *command])}" in run.stdout
    if command in ([], ["align"]):
        assert re.search(r"Exit codes: 0 .*2 usage, 3 input, 4 not sure", run.stdout)


def test_version_and_instruction_set(vnreg: Program) -> None:
    run = vnreg("--version")
    assert (run.code, run.stderr) == (OK, "")
    assert re.fullmatch(r"vnreg \d+\.\d+\.\d+ \([\w-]+\)\n", run.stdout)


def test_info_is_what_the_file_holds(vnreg: Program, model: Path, golden: Path) -> None:
    for path in (model, golden):
        metadata, tensors = read_model(path)
        answer = vnreg("info", path, "--json").json()
        assert list(answer) == ["metadata", "tensors", "totals"]
        assert answer["metadata"] == metadata
        dtypes = {"float32": "f32", "float64": "f64", "int32": "i32"}
        assert answer["tensors"] == [
            {
                "name": name,
                "dtype": dtypes[tensor.dtype.name],
                "shape": list(tensor.shape),
                "bytes": tensor.nbytes,
            }
            for name, tensor in tensors.items()
        ]
        assert answer["totals"] == {
            "tensors": len(tensors),
            "elements": sum(tensor.size for tensor in tensors.values()),
            "tensor_bytes": sum(tensor.nbytes for tensor in tensors.values()),
            "file_bytes": path.stat().st_size,
        }


def test_info_as_text(vnreg: Program, model: Path) -> None:
    metadata, tensors = read_model(model)
    run = vnreg("info", model)
    assert (run.code, run.stderr) == (OK, "")
    rows = [line.split() for line in run.stdout.splitlines()]
    assert ["name", "arbitrary"] in rows
    assert ["relu.shared_direction", "false"] in rows
    assert ["encoder.pre", "f32", "32", "x", "3", "384"] in rows
    for name in [*metadata, *tensors]:
        assert any(row[0] == name for row in rows)
    assert run.stdout.endswith(f" bytes; file {model.stat().st_size} bytes\n")


def test_selftest_agrees_with_torch(vnreg: Program, model: Path, golden: Path) -> None:
    run = vnreg("selftest", "--model", model)
    assert (run.code, run.stderr) == (OK, ""), run.stdout
    lines = run.stdout.splitlines()
    stages = [
        name.removeprefix("stage.") for name in read_model(golden)[1] if name.startswith("stage.")
    ]
    assert sorted(line.split()[1] for line in lines[:-1]) == sorted(stages)
    assert all(line.startswith("ok ") for line in lines[:-1])
    assert lines[-1].startswith(f"{len(stages)} of {len(stages)} stages equal ")
    assert vnreg("selftest", "--model", model, "--golden", golden).stdout == run.stdout


@pytest.mark.parametrize(
    ("stage", "change"),
    [
        ("stage.source.network0.block1", 1e-4),
        ("stage.target.descriptor", 1e-4),
        ("stage.source.kept", 1),
        ("stage.fine.0.match", 1),
        ("stage.coarse.T", 1e-3),
    ],
)
def test_selftest_notices_a_difference(
    vnreg: Program, model: Path, golden: Path, tmp_path: Path, stage: str, change: float
) -> None:
    metadata, tensors = read_model(golden)
    tensor = tensors[stage].copy()
    # One number is changed, by a small part of the norm of all.
    tensor.flat[0] += change if tensor.dtype.kind == "i" else change * np.linalg.norm(tensor)
    write_model(tmp_path / "changed.golden.vnr", metadata, tensors | {stage: tensor})
    run = vnreg("selftest", "--model", model, "--golden", tmp_path / "changed.golden.vnr")
    assert (run.code, run.stderr) == (FAILURE, "")
    failed = [line.split()[1] for line in run.stdout.splitlines() if line.startswith("FAIL ")]
    assert failed == [stage.removeprefix("stage.")]


def test_selftest_notices_what_is_not_computed(
    vnreg: Program, model: Path, golden: Path, tmp_path: Path
) -> None:
    metadata, tensors = read_model(golden)
    extra = {
        "stage.source.invented": np.zeros(3, np.float32),
        "stage.source.points": tensors["stage.source.points"][:-1],
    }
    write_model(tmp_path / "more.golden.vnr", metadata, tensors | extra)
    run = vnreg("selftest", "--model", model, "--golden", tmp_path / "more.golden.vnr")
    assert run.code == FAILURE
    assert re.search(r"^FAIL  source\.invented +not computed$", run.stdout, re.MULTILINE)
    assert re.search(
        r"^FAIL  source\.points +computed with another shape$", run.stdout, re.MULTILINE
    )


def test_selftest_refuses_files_that_do_not_belong_together(
    vnreg: Program, model: Path, golden: Path, tmp_path: Path
) -> None:
    metadata, tensors = read_model(model)
    other = tmp_path / "other.vnr"
    write_model(other, metadata | {"provenance.data": "other"}, tensors)
    missing = tmp_path / "other.golden.vnr"
    assert vnreg("selftest", "--model", other).error(INPUT).startswith(f"{missing}: expected")
    message = vnreg("selftest", "--model", other, "--golden", golden).error(INPUT)
    assert message.startswith(f"{golden}: model.crc: expected")
    message = vnreg("selftest", "--model", model, "--golden", model).error(INPUT)
    assert message.startswith(f"{model}: arch: expected golden, found paper")
    metadata, tensors = read_model(golden)
    empty = tmp_path / "empty.golden.vnr"
    write_model(empty, metadata, {k: v for k, v in tensors.items() if k.startswith("input.")})
    assert "stage.*" in vnreg("selftest", "--model", model, "--golden", empty).error(INPUT)
    del tensors["input.source"]
    write_model(empty, metadata, tensors)
    assert "input.source" in vnreg("selftest", "--model", model, "--golden", empty).error(INPUT)


def test_an_installed_program_finds_its_files(
    program_path: Path, model: Path, golden: Path, tmp_path: Path
) -> None:
    (tmp_path / "bin").mkdir()
    share = tmp_path / "share" / "vnreg"
    share.mkdir(parents=True)
    shutil.copy(program_path, tmp_path / "bin" / "vnreg")
    shutil.copy(model, share / "vnreg.vnr")
    shutil.copy(golden, share / "vnreg.golden.vnr")
    run = subprocess.run(
        [tmp_path / "bin" / "vnreg", "selftest"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert run.returncode == OK, run
    assert str(share / "vnreg.golden.vnr") in run.stdout


@pytest.mark.parametrize("name", ["small", "vnreg"])
def test_the_shipped_models_replay(vnreg: Program, name: str) -> None:
    run = vnreg("selftest", "--model", repository / "models" / f"{name}.vnr")
    assert (run.code, run.stderr) == (OK, ""), run.stdout


def test_selftest_replays_the_built_in_model_by_default(vnreg: Program) -> None:
    run = vnreg("selftest")
    assert (run.code, run.stderr) == (OK, ""), run.stdout
    assert "vnreg.golden.vnr" in run.stdout
