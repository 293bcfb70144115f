"""Several sources onto one target, standard input, and the schema of what `--json` prints."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from cli_program import INPUT, NOT_SURE, OK, USAGE, Program, moved, random_pose, repository
from cli_tables import QUICK, write_clouds
from numpy.typing import NDArray

Points = NDArray[np.float64]


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    text = (repository / "docs" / "schemas" / "align.schema.json").read_text()
    document: dict[str, Any] = json.loads(text)
    jsonschema.Draft202012Validator.check_schema(document)
    return document


@pytest.fixture()
def folder(shape: Points, tmp_path: Path) -> Path:
    """`scans` with four clouds and two other files, and a target beside it."""
    scans = tmp_path / "scans"
    scans.mkdir()
    write_clouds(scans, shape, 4)
    (scans / "README").write_text("no cloud\n")
    (scans / "older.npy").mkdir()
    np.save(tmp_path / "target.npy", shape[50:250])
    return tmp_path


def without_times(answer: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in answer.items() if key not in ("ms", "source")}


def test_a_folder_a_pattern_and_several_files(
    vnreg: Program, folder: Path, schema: dict[str, Any]
) -> None:
    files = sorted((folder / "scans").glob("*_*.npy"))
    target = folder / "target.npy"
    answers = []
    for sources in ([folder / "scans"], [folder / "scans" / "c*_00[0-9].np?"], files):
        run = vnreg("align", *sources, target, "--json", *QUICK)
        assert run.code == OK
        answer = run.json()
        jsonschema.validate(answer, schema)
        assert answer["target"] == str(target)
        assert [result["source"] for result in answer["results"]] == [str(file) for file in files]
        answers.append([without_times(result) for result in answer["results"]])
    assert answers[0] == answers[1] == answers[2]
    alone = [vnreg("align", file, target, "--json", *QUICK).json() for file in files]
    assert [without_times(answer) for answer in alone] == answers[0]


def test_several_sources_as_text(vnreg: Program, folder: Path) -> None:
    (folder / "scans" / "bad.ply").write_text("ply\n")
    run = vnreg("align", folder / "scans", folder / "target.npy", *QUICK)
    assert (run.code, run.stderr) == (INPUT, "")
    rows = [line.split(maxsplit=1) for line in run.stdout.splitlines()]
    assert [status for status, _ in rows] == ["unreadable", "ok", "ok", "ok", "ok"]
    assert "expected 'end_header'" in rows[0][1]
    assert rows[1][1].endswith(str(folder / "scans" / "cloud_000.npy"))


def test_what_is_not_there(vnreg: Program, folder: Path) -> None:
    target = folder / "target.npy"
    (folder / "empty").mkdir()
    for sources in ("empty", "none*.ply"):
        message = vnreg("align", folder / sources, target).error(INPUT)
        assert message.startswith(f"{folder / sources}: expected files of point clouds")
    for bad in ("none.ply", "scans"):
        assert vnreg("align", folder / "scans", folder / bad).error(INPUT).startswith(f"{folder}")


def test_a_file_whose_name_is_a_pattern(vnreg: Program, folder: Path) -> None:
    odd = folder / "scan[1]*.npy"
    shutil.copy(folder / "target.npy", odd)
    assert vnreg("align", odd, folder / "target.npy", "--json", *QUICK).json()["status"] == "ok"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-", "-"], "expected standard input (-) for one cloud, found it for several"),
        (
            ["-", "a.ply", "b.ply"],
            "expected files as several sources, found standard input (-) among them",
        ),
        (
            ["a.ply", "b.ply", "c.ply", "-o", "moved.ply"],
            "expected one source with --output, found several, a folder or a pattern",
        ),
        (
            ["a.ply", "b.ply", "c.ply", "--html", "view.html"],
            "expected one source with --html, found several, a folder or a pattern",
        ),
    ],
)
def test_what_does_not_go_together(vnreg: Program, arguments: list[str], message: str) -> None:
    assert vnreg("align", *arguments).error(USAGE) == message


# ---- every status, in its form ----


def with_calibration(model: Path, path: Path, bias: float) -> Path:
    """The model with a confidence that is the same for every pose of mode coarse."""
    from vnreg_train.model_file import read_model, write_model

    metadata, tensors = read_model(model)
    names = ["overlap", "residual"]
    calibration = {"calibration.bias": bias} | {f"calibration.{name}": 0.0 for name in names}
    write_model(path, metadata | calibration, tensors)
    return path


def test_every_status_follows_the_schema(
    vnreg: Program, model: Path, shape: Points, folder: Path, schema: dict[str, Any]
) -> None:
    scans = folder / "scans"
    half = shape[:150] + [0, 1, 0]
    np.save(scans / "symmetric.npy", np.concatenate([half, half * [-1, -1, 1]]))
    np.save(scans / "large.npy", shape * 1000)
    (scans / "few.xyz").write_text("1 2 3\n4 5 6\n")
    (scans / "equal.xyz").write_text("1 2 3\n" * 100)
    (scans / "nan.xyz").write_text("1 2 nan\n" * 100)
    (scans / "bad.ply").write_text("ply\n")
    unsure = with_calibration(model, folder / "unsure.vnr", -50.0)
    body = np.concatenate([half, half * [-1, -1, 1]])
    np.save(folder / "body.npy", moved(random_pose(9), body))
    runs = [
        (["target.npy", "--model", str(model)], INPUT),
        (["target.npy", "--model", str(unsure), "--mode", "paper"], INPUT),
        (["body.npy", "--model", str(model), "--max-points=300"], INPUT),
        (["target.npy", "--budget-ms", "0.000001"], INPUT),
    ]
    seen: dict[str, set[str]] = {"posed": set(), "failed": set()}
    for (target, *more), code in runs:
        run = vnreg("align", scans, folder / target, "--json", *more)
        assert run.code == code
        answer = run.json()
        jsonschema.validate(answer, schema)
        for result in answer["results"]:
            form = "failed" if "error" in result else "posed"
            seen[form].add(result["status"])
    assert seen["failed"] >= {"unreadable", "too_few_points", "degenerate", "not_finite"}
    assert "timed_out" in seen["failed"] | seen["posed"]
    assert seen["posed"] >= {"ok", "low_confidence", "ambiguous", "scales_differ"}


def test_the_schema_refuses_what_is_not_documented(
    vnreg: Program, folder: Path, schema: dict[str, Any]
) -> None:
    answer = vnreg("align", folder / "scans", folder / "target.npy", "--json", *QUICK).json()
    alone = without_times(answer["results"][0])
    broken: list[Any] = [
        {},
        alone,  # without its times
        {**answer, "results": []},
        {**answer, "results": [{**answer["results"][0], "status": "fine"}]},
        {**answer, "results": [{**answer["results"][0], "T_target_source": [[1]]}]},
        {**answer, "results": [{"source": "a", "status": "unreadable"}]},
    ]
    for document in broken:
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(document, schema)


def test_one_source_follows_the_schema(
    vnreg: Program, folder: Path, schema: dict[str, Any]
) -> None:
    for mode in ("coarse", "verified"):
        arguments = (folder / "scans" / "cloud_000.npy", folder / "target.npy", "--mode", mode)
        jsonschema.validate(vnreg("align", *arguments, "--json").json(), schema)


# ---- standard input, time ----


def test_a_cloud_from_standard_input(vnreg: Program, folder: Path) -> None:
    scan, target = folder / "scans" / "cloud_000.npy", folder / "target.npy"
    named = without_times(vnreg("align", scan, target, "--json", *QUICK).json())
    rows = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in np.load(scan).tolist())
    for content, more in (
        (scan.read_bytes(), []),
        (rows.encode(), []),
        (rows.encode(), ["--format", "xyz"]),
    ):
        run = vnreg("align", "-", target, "--json", *QUICK, *more, stdin=content)
        assert without_times(run.json()) == named
    run = vnreg("align", scan, "-", "--json", *QUICK, stdin=target.read_bytes())
    assert without_times(run.json()) == named
    many = vnreg("align", folder / "scans", "-", "--json", *QUICK, stdin=target.read_bytes())
    assert without_times(many.json()["results"][0]) == named
    assert many.json()["target"] == "standard input"


def test_standard_input_that_is_no_cloud(vnreg: Program, folder: Path) -> None:
    target = folder / "target.npy"
    message = vnreg("align", "-", target, stdin=b"").error(INPUT)
    assert message == "standard input: expected a point cloud, found an empty file"
    message = vnreg("align", "-", target, "--format", "ply", stdin=b"1 2 3\n" * 90).error(INPUT)
    assert message.startswith("standard input: line 1: expected 'ply'")
    assert vnreg("align", "-", target, "--format", "stl", stdin=b"").error(USAGE)


def test_a_budget_that_is_too_short_for_any_pose(vnreg: Program, folder: Path) -> None:
    pair = (folder / "scans" / "cloud_000.npy", folder / "target.npy")
    run = vnreg("align", *pair, "--budget-ms", "0.000001", "--json")
    assert run.code == NOT_SURE
    if run.stdout:
        assert run.json()["status"] == "timed_out"
    else:
        assert "expected a pose within the time budget" in run.error(NOT_SURE)
    assert vnreg("align", *pair, "--budget-ms", "100000", "--json").json()["status"] != "timed_out"
