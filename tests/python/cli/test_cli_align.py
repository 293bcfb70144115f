"""`vnreg align`, as a user runs it."""

from __future__ import annotations

import math
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_clouds import read_ply
from cli_program import (
    NOT_SURE,
    OK,
    Program,
    moved,
    random_pose,
    repository,
    rotation_error_deg,
)
from numpy.typing import NDArray

from vnreg_train.model_file import read_model, write_model

Points = NDArray[np.float64]


@pytest.fixture(scope="module")
def pose() -> Points:
    return random_pose(5)


@pytest.fixture(scope="module")
def pair(
    shape: Points, pose: Points, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path]:
    """A cloud, and the same cloud moved and in another order."""
    folder = tmp_path_factory.mktemp("pair")
    np.save(folder / "source.npy", shape)
    target = np.random.default_rng(6).permutation(moved(pose, shape))
    np.savetxt(folder / "target.xyz", target, fmt="%.17g")
    return folder / "source.npy", folder / "target.xyz"


def without_times(answer: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in answer.items() if key != "ms"}


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("built_in", [False, True], ids=["arbitrary weights", "built-in model"])
def test_a_moved_cloud_gives_back_its_pose(
    vnreg: Program, model: Path, shape: Points, tmp_path: Path, built_in: bool, seed: int
) -> None:
    # Equivariance makes the clean setting exact, whatever the weights.
    pose = random_pose(seed)
    # No more points than are described (256): of the permuted cloud that would be other ones.
    cloud = shape[:250]
    np.save(tmp_path / "a.npy", cloud)
    np.save(tmp_path / "b.npy", np.random.default_rng(seed).permutation(moved(pose, cloud)))
    arguments = ["--json", "--mode=coarse"]
    if not built_in:
        arguments += ["--model", str(model)]
    run = vnreg("align", tmp_path / "a.npy", tmp_path / "b.npy", *arguments)
    assert run.code == OK
    found = np.array(run.json()["T_target_source"])
    assert rotation_error_deg(found, pose) < 0.1
    assert np.abs(found - pose).max() < 2e-3


def test_any_unit_and_any_origin(
    vnreg: Program, model: Path, shape: Points, tmp_path: Path
) -> None:
    # Millimetres in a national grid: the digits of a float would not do.
    pose = random_pose(11)
    pose[:3, 3] = [-3.2e6, 5.4e6, 120.0]
    source = 1000 * shape + [6.5e5, 5.3e6, 400.0]
    np.save(tmp_path / "a.npy", source)
    np.save(tmp_path / "b.npy", moved(pose, source))
    run = vnreg(
        "align", tmp_path / "a.npy", tmp_path / "b.npy", "--json", "--mode=coarse", "--model", model
    )
    found = np.array(run.json()["T_target_source"])
    assert rotation_error_deg(found, pose) < 0.1
    assert np.abs(moved(found, source) - moved(pose, source)).max() < 3


def check_pose(rows: object) -> None:
    pose = np.array(rows)
    assert pose.shape == (4, 4) and pose.dtype == np.float64
    assert np.array_equal(pose[3], [0, 0, 0, 1])
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-9)
    assert math.isclose(np.linalg.det(pose[:3, :3]), 1, abs_tol=1e-9)


@pytest.mark.parametrize("mode", ["coarse", "paper", "verified"])
def test_json_has_the_documented_keys_and_types(
    vnreg: Program, model: Path, pair: tuple[Path, Path], mode: str
) -> None:
    run = vnreg("align", *pair, "--json", "--model", model, "--mode", mode)
    assert run.code == OK
    answer = run.json()
    documented = (repository / "docs" / "cli.md").read_text().partition("Keys of the JSON")[2]
    keys = documented.partition("\n\n")[2].partition("\n\n")[0].splitlines()[2:]
    assert sorted(answer) == sorted(re.findall(r"`(\w+)`", " ".join(k.split("|")[1] for k in keys)))
    assert answer["status"] == "ok"
    check_pose(answer["T_target_source"])
    check_pose(answer["T_target_source_coarse"])
    assert answer["confidence"] is None  # this model has no calibration
    assert 0 <= answer["overlap"] <= 1
    assert 0 <= answer["rmse"] <= answer["inlier_distance"]
    if mode == "verified":
        assert 0 < answer["score"] <= 1
        covariance = np.array(answer["covariance"])
        assert covariance.shape == (6, 6)
        assert np.array_equal(covariance, covariance.T)
        assert np.linalg.eigvalsh(covariance).min() > 0
        assert answer["evidence"]["score"] == answer["score"]
        assert all(math.isfinite(value) for value in answer["evidence"].values())
    else:
        assert answer["score"] is answer["covariance"] is answer["evidence"] is None
        assert answer["alternatives"] == []
    assert (answer["points_source"], answer["points_target"]) == (256, 256)
    times = answer["ms"]
    assert list(times)[:4] == ["prepare", "encode", "coarse", "fine"]
    assert list(times)[-2:] == ["measure", "total"]
    assert all(isinstance(ms, float | int) and ms >= 0 for ms in times.values())
    assert times["total"] >= times["encode"]
    assert (answer["model"], answer["mode"]) == ("arbitrary", mode)


def test_a_symmetric_body_is_ambiguous(
    vnreg: Program, model: Path, shape: Points, tmp_path: Path
) -> None:
    # Half a turn about z maps the body onto itself.
    body = np.concatenate([shape[:150] + [0, 1, 0], (shape[:150] + [0, 1, 0]) * [-1, -1, 1]])
    np.save(tmp_path / "a.npy", body)
    np.save(tmp_path / "b.npy", moved(random_pose(9), body))
    arguments = ("--json", "--model", model, "--mode=verified", "--max-points=300")
    run = vnreg("align", tmp_path / "a.npy", tmp_path / "b.npy", *arguments)
    assert run.code == NOT_SURE
    answer = run.json()
    assert answer["status"] == "ambiguous"
    assert answer["alternatives"]
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    poses = [answer, *answer["alternatives"]]
    for expected in (random_pose(9), random_pose(9) @ half_turn):
        errors = [rotation_error_deg(np.array(p["T_target_source"]), expected) for p in poses]
        assert min(errors) < 2
    text = vnreg("align", tmp_path / "a.npy", tmp_path / "b.npy", *arguments[1:]).stdout
    assert "status       ambiguous" in text
    angles = re.findall(
        r"^alternative  score .*, ([.\d]+) degrees and .* from this pose$", text, re.MULTILINE
    )
    assert len(angles) == len(answer["alternatives"])
    assert any(abs(float(angle) - 180) < 2 for angle in angles)
    for alternative in answer["alternatives"]:
        assert list(alternative) == ["T_target_source", "score"]
        check_pose(alternative["T_target_source"])
        assert 0 < alternative["score"] <= answer["score"]


def test_verified_is_the_default_mode(vnreg: Program, model: Path, pair: tuple[Path, Path]) -> None:
    plain = vnreg("align", *pair, "--json", "--model", model).json()
    assert plain["mode"] == "verified"
    asked = vnreg("align", *pair, "--json", "--model", model, "--mode", "verified").json()
    assert without_times(plain) == without_times(asked)


def test_text_tells_how_sure_the_verified_pose_is(
    vnreg: Program, model: Path, pair: tuple[Path, Path], shape: Points
) -> None:
    answer = vnreg("align", *pair, "--json", "--model", model).json()
    text = vnreg("align", *pair, "--model", model).stdout
    number = r"([-+.\de]+)"
    line = rf"uncertainty  {number} degrees, {number} at the middle of the source"
    match = re.search(line, text)
    assert match
    degrees, length = (float(printed) for printed in match.groups())
    covariance = np.array(answer["covariance"])
    assert math.isclose(
        degrees, math.degrees(math.sqrt(np.trace(covariance[:3, :3]))), rel_tol=0.06
    )
    # Of many errors drawn from the covariance: how far they move the middle of the source.
    middle = moved(np.array(answer["T_target_source"]), shape.mean(0)[None])[0]
    draws = np.random.default_rng(0).multivariate_normal(np.zeros(6), covariance, size=20_000)
    moves = draws[:, 3:] + np.cross(draws[:, :3], middle)
    assert math.isclose(length, math.sqrt((moves**2).sum(1).mean()), rel_tol=0.1)
    assert re.search(rf"^score        {number}$", text, re.MULTILINE)


def test_text_says_what_json_says(vnreg: Program, model: Path, pair: tuple[Path, Path]) -> None:
    arguments = ("align", *pair, "--model", model, "--mode", "coarse")
    answer = vnreg(*arguments, "--json").json()
    run = vnreg(*arguments)
    assert (run.code, run.stderr) == (OK, "")
    lines = run.stdout.splitlines()
    assert lines[0] == "T_target_source"
    printed = np.array([[float(word) for word in line.split()] for line in lines[1:5]])
    found = np.array(answer["T_target_source"])
    assert np.allclose(printed, found, rtol=1e-9, atol=1e-12)
    rest = {line.split()[0]: line.split(maxsplit=1)[1] for line in lines[5:]}
    assert list(rest) == [
        "rotation",
        "translation",
        "status",
        "confidence",
        "overlap",
        "rmse",
        "points",
        "model",
        "time",
    ]
    number = r"([-+.\de]+)"
    match = re.fullmatch(
        rf"{number} degrees about \({number}, {number}, {number}\)", rest["rotation"]
    )
    assert match
    angle, *axis = (float(text) for text in match.groups())
    assert math.isclose(
        1 + 2 * math.cos(math.radians(angle)), np.trace(found[:3, :3]), abs_tol=1e-4
    )
    assert np.allclose(found[:3, :3] @ axis, axis, atol=1e-4)
    assert rest["status"] == "ok"
    assert rest["confidence"] == "n/a"
    assert rest["model"] == "arbitrary, mode coarse"
    assert re.fullmatch(rf"prepare {number} encode {number} .* total {number} ms", rest["time"])


def test_output_holds_every_moved_point(
    vnreg: Program, model: Path, pair: tuple[Path, Path], shape: Points, tmp_path: Path
) -> None:
    output = tmp_path / "moved.ply"
    output.write_text("older")
    arguments = ("--json", "--model", model, "-o", output, "--max-points", "64")
    answer = vnreg("align", *pair, *arguments).json()
    assert (answer["points_source"], answer["points_target"]) == (64, 64)
    expected = moved(np.array(answer["T_target_source"]), shape)
    assert np.allclose(read_ply(output), expected, rtol=0, atol=1e-12)
    assert [path.name for path in tmp_path.iterdir()] == ["moved.ply"]


def test_same_bits_whatever_the_threads(
    vnreg: Program, model: Path, pair: tuple[Path, Path]
) -> None:
    answers = [
        without_times(
            vnreg("align", *pair, "--json", "--model", model, "--threads", threads).json()
        )
        for threads in ("0", "1", "2", "3")
    ]
    assert all(answer == answers[0] for answer in answers)


def test_the_seed_chooses_the_points(vnreg: Program, model: Path, pair: tuple[Path, Path]) -> None:
    arguments = ("align", *pair, "--json", "--model", model, "--max-points", "100")
    first, again, other = (
        without_times(vnreg(*arguments, "--seed", seed).json())
        for seed in ("0", "0", "18446744073709551615")
    )
    assert first == again
    assert first["T_target_source"] != other["T_target_source"]


@pytest.mark.parametrize("mode", ["paper", "verified"])
@pytest.mark.parametrize(("bias", "code"), [(-50.0, NOT_SURE), (50.0, OK)])
def test_the_exit_code_says_whether_the_pose_is_trusted(
    vnreg: Program,
    model: Path,
    pair: tuple[Path, Path],
    tmp_path: Path,
    bias: float,
    code: int,
    mode: str,
) -> None:
    metadata, tensors = read_model(model)
    names = ["overlap", "residual"]
    if mode == "verified":
        names = list(vnreg("align", *pair, "--json", "--model", model).json()["evidence"])
    prefix = {"paper": "calibration.", "verified": "calibration.verified."}[mode]
    metadata |= {prefix + "bias": bias} | {prefix + name: 0.0 for name in names}
    write_model(tmp_path / "calibrated.vnr", metadata, tensors)
    arguments = (
        "align",
        *pair,
        "--mode",
        mode,
        "--model",
        tmp_path / "calibrated.vnr",
        "-o",
        tmp_path / "moved.ply",
    )
    run = vnreg(*arguments, "--json")
    assert run.code == code
    answer = run.json()
    assert answer["status"] == ("ok" if code == OK else "low_confidence")
    assert math.isclose(answer["confidence"], 1 / (1 + math.exp(-bias)), abs_tol=1e-6)
    assert np.array(answer["T_target_source"]).shape == (4, 4)
    assert len(read_ply(tmp_path / "moved.ply")) == 300
    run = vnreg(*arguments)
    assert (run.code, run.stderr) == (code, "")
    assert f"status       {answer['status']}\n" in run.stdout


def test_a_cloud_may_come_through_a_pipe(
    vnreg: Program, model: Path, pair: tuple[Path, Path]
) -> None:
    source, target = pair
    run = vnreg(
        "align", "/dev/stdin", target, "--json", "--model", model, stdin=source.read_bytes()
    )
    assert without_times(run.json()) == without_times(
        vnreg("align", source, target, "--json", "--model", model).json()
    )


def test_names_with_blanks_and_beyond_ascii(
    vnreg: Program, model: Path, pair: tuple[Path, Path], tmp_path: Path
) -> None:
    source, target = tmp_path / "größe 1.npy", tmp_path / "-dash.xyz"
    shutil.copy(pair[0], source)
    shutil.copy(pair[1], target)
    output = tmp_path / "naïve 2.PLY"
    assert vnreg("align", "--model", model, "-o", output, "--", source, target).code == OK
    assert output.is_file()
