"""`vnreg bench`: a line for every mode of the model, number of points and of threads."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import jsonschema
import pytest
from cli_program import INPUT, OK, USAGE, Program, repository

POINTS = [256, 512, 1024, 2048, 4096]


def threads_here() -> list[int]:
    return sorted({1, len(os.sched_getaffinity(0))})


@pytest.fixture(autouse=True)
def _threads_that_sleep(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where other programs run, threads that wait by spinning take minutes."""
    monkeypatch.setenv("OMP_WAIT_POLICY", "passive")


@pytest.mark.parametrize(
    ("model", "modes"),
    [(None, ["coarse", "verified"]), ("small.vnr", ["coarse", "paper", "verified"])],
)
def test_bench_as_json(vnreg: Program, model: str | None, modes: list[str]) -> None:
    more = ["--model", repository / "models" / model] if model else []
    points = ["--points", "64", "128"] if model else []
    answer = vnreg("bench", "--json", "--seconds", "0", *points, *more).json()
    schema = json.loads((repository / "docs" / "schemas" / "bench.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(answer, schema)
    assert answer["model"] == (model or "vnreg.vnr").removesuffix(".vnr")
    name = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    assert name and answer["processor"] == name[1]
    assert answer["instruction_set"] in vnreg("--version").stdout
    counts = [64, 128] if model else POINTS
    lines = [(time["mode"], time["points"], time["threads"]) for time in answer["times"]]
    assert lines == [(m, p, t) for m in modes for p in counts for t in threads_here()]
    for time in answer["times"]:
        assert 0 < time["ms_median"] <= time["ms_p90"]
        assert time["pairs_per_second"] == pytest.approx(1000 / time["ms_median"])


def test_bench_as_text(vnreg: Program) -> None:
    run = vnreg("bench", "--seconds", "0", "--points", "64")
    assert (run.code, run.stderr) == (OK, "")
    rows = re.findall(r"^(\w+) +(\d+) +(\d+) +[\d.e+]+ +[\d.e+]+ +[\d.e+]+$", run.stdout, re.M)
    assert len(rows) == 2 * len(threads_here())


def test_longer_measurements_have_more_runs(vnreg: Program) -> None:
    few, more = (
        vnreg("bench", "--json", "--points", "64", "--seconds", seconds).json()["times"][0]["runs"]
        for seconds in ("0", "0.3")
    )
    assert few == 5 < more


def test_bench_says_what_is_wrong(vnreg: Program, tmp_path: Path) -> None:
    assert vnreg("bench", "--seconds", "-1").error(USAGE)
    assert vnreg("bench", "--points", "63").error(USAGE)
    assert vnreg("bench", "--model", tmp_path / "none.vnr").error(INPUT)
