"""What only a person at a terminal sees: progress and colours."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from cli_program import INPUT, OK, Program
from cli_tables import QUICK, write_clouds, write_pairs
from cli_terminal import at_terminal
from numpy.typing import NDArray

ESCAPE = "\x1b["
ERASE = "\r\x1b[K"
COLOUR = re.compile(r"\x1b\[3\dm")


@pytest.fixture()
def folder(shape: NDArray[np.float64], tmp_path: Path) -> Path:
    """Eight clouds and a table of 200 pairs of them, enough for some drawings."""
    write_pairs(tmp_path / "pairs.csv", write_clouds(tmp_path, shape, 8), 200)
    return tmp_path


def test_a_long_run_shows_how_far_it_is(program_path: Path, folder: Path) -> None:
    output = folder / "results.csv"
    command = (program_path, "batch", folder / "pairs.csv", "-o", output, "--max-points", "128")
    code, drawn = at_terminal(*command, "--threads", "1")
    assert code == OK
    pattern = r"\[(#*)(\.*)\] (\d+) of 200, [\d.e+]+ a second, \d+:\d\d:\d\d left"
    drawings = re.findall(pattern, drawn)
    assert len(drawings) >= 2
    counts = [int(count) for *_, count in drawings]
    assert counts == sorted(counts) and 0 < counts[0] < 200
    for full, empty, count in drawings:
        assert len(full) + len(empty) == 40 and len(full) == 40 * int(count) // 200
    assert drawn.count(ERASE) == len(drawings) + 1
    assert "200 of 200 pairs in" in drawn.rpartition(ERASE)[2]


def test_a_narrow_terminal_is_not_overrun(program_path: Path, folder: Path) -> None:
    output = folder / "results.csv"
    command = (program_path, "batch", folder / "pairs.csv", "-o", output, "--max-points", "128")
    _, drawn = at_terminal(*command, "--threads", "1", columns=50)
    lines = [line for line in drawn.split(ERASE) if " a second, " in line]
    assert lines and all(len(line) < 50 for line in lines)


@pytest.mark.parametrize("quieter", ["--quiet", "TERM=dumb"])
def test_progress_can_be_silenced(program_path: Path, folder: Path, quieter: str) -> None:
    command = [program_path, "batch", folder / "pairs.csv", "-o", folder / "r.csv", *QUICK]
    if quieter == "--quiet":
        assert at_terminal(*command, quieter) == (OK, "")
    else:
        _, drawn = at_terminal(*command, environment={"TERM": "dumb"})
        assert ESCAPE not in drawn and drawn.startswith("200 of 200 pairs")


def test_colours_are_for_terminals(vnreg: Program, program_path: Path, folder: Path) -> None:
    (folder / "bad.ply").write_text("ply\n")
    command = ("align", folder / "cloud_000.npy", folder / "bad.ply", folder / "cloud_001.npy")
    code, drawn = at_terminal(program_path, *command, *QUICK, "--quiet")
    assert code == INPUT
    assert "\x1b[32mok" in drawn and "\x1b[31munreadable" in drawn
    quiet = (*command, *QUICK, "--quiet")
    _, plain = at_terminal(program_path, *quiet, environment={"NO_COLOR": "1"})
    assert not COLOUR.search(plain)
    assert plain.split() == COLOUR.sub("", drawn).replace("\x1b[0m", "").split()
    _, coloured = at_terminal(program_path, *quiet, environment={"NO_COLOR": ""})
    assert COLOUR.search(coloured)
    run = vnreg(*command, *QUICK)
    assert ESCAPE not in run.stdout + run.stderr


def test_an_error_is_red_at_a_terminal(program_path: Path) -> None:
    _, drawn = at_terminal(program_path, "align", "none.ply", "none.ply")
    assert drawn.startswith("\x1b[31mvnreg:\x1b[0m none.ply: expected")
    _, drawn = at_terminal(program_path, "frobnicate", environment={"NO_COLOR": "yes"})
    assert drawn.startswith("vnreg: ")


def test_the_pose_of_one_pair_is_coloured_at_a_terminal(program_path: Path, folder: Path) -> None:
    pair = (folder / "cloud_000.npy", folder / "cloud_001.npy")
    _, drawn = at_terminal(program_path, "align", *pair, *QUICK)
    assert "status       \x1b[32mok\x1b[0m" in drawn
    _, drawn = at_terminal(program_path, "align", *pair, *QUICK, "--json")
    assert ESCAPE not in drawn
