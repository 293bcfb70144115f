"""The commands, from their words to what they print and write."""

from __future__ import annotations

from pathlib import Path

import pytest
from shipped import SHIPPED

from vnreg_train.cli import parser
from vnreg_train.evaluate import commands
from vnreg_train.evaluate.commands import select_methods
from vnreg_train.evaluate.symmetry import TRIVIAL
from vnreg_train.evaluate.table import HEAD


def run(*words: str) -> None:
    arguments = parser().parse_args(list(words))
    arguments.run_command(arguments)


def test_methods_by_name_and_by_group() -> None:
    assert select_methods(["modes"]) == {"coarse", "paper", "verified"}
    assert select_methods(["verified", "small_gicp"]) == {"verified", "small_gicp"}
    assert "kiss_matcher_icp" in select_methods(["peers"])
    with pytest.raises(ValueError, match="no method is called 'icp'.*small_gicp"):
        select_methods(["verified", "icp"])


def test_evaluate_prints_a_line_per_row_and_report_writes_the_page(
    data_folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shapes = [f"validation-{letter}" for letter in "abcdef"]
    monkeypatch.setattr(commands, "read_symmetries", lambda *_: dict.fromkeys(shapes, TRIVIAL))
    common = ["--data", str(data_folder), "--split", "validation", "--shapes", "3"]
    common += ["--run", str(tmp_path / "run")]
    rows = ["P0/clean/45", "P1/partial_50"]
    paper = ["--methods", "coarse", "--paper-model", str(SHIPPED), "--failures"]
    run("evaluate", *common, "--rows", *rows, *paper)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == HEAD
    assert lines[1].split()[:4] == ["P0/clean/45", "coarse", "3", "100.0"]
    assert lines[2].split()[:3] == ["P1/partial_50", "coarse", "3"]
    lost = [line for line in lines[3:] if line.startswith("    ")]
    assert len(lost) == round(3 - 3 * float(lines[2].split()[3]) / 100) > 0
    assert all("validation-" in line and "overlap" in line for line in lost)

    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    run("report", *common, "--out", str(page))
    text = page.read_text(encoding="utf-8")
    assert "| clean | coarse | 100.0 (43.9–100.0) |" in text
    assert "(page/overlap.svg)" in text and "(page/results.json)" in text
    assert (page.parent / "page" / "overlap.svg").stat().st_size > 1000
    again = tmp_path / "again.md"
    run("report", "--figures", str(page.parent / "page" / "results.json"), "--out", str(again))
    assert again.read_text(encoding="utf-8") == text.replace("(page/", "(again/")
    for plot in (page.parent / "page").glob("*.svg"):
        assert (tmp_path / "again" / plot.name).read_bytes() == plot.read_bytes()
