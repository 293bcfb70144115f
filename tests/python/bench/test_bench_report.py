"""The bars, and the page that is written of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from vnreg_bench.bars import BARS, fastest_global_peer, verdicts
from vnreg_bench.plots import draw_plots, series
from vnreg_bench.report import markdown


def verdict(report: dict[str, Any], words: str) -> dict[str, Any]:
    (found,) = [v for v in verdicts(report) if words in v["what"]]
    return found


@pytest.mark.parametrize(
    ("words", "measured", "met", "aim_met"),
    [
        ("default network, 1 thread: share", "59 %", False, False),
        ("paper network (C = 128", "90 %", True, True),
        ("whole paper mode", "20.0 pairs/s", False, False),
        ("1,024 points, 1 thread, median", "10.5 ms", False, False),
        ("512 points, 1 thread, median", "4.0 ms", True, False),
        ("two threads", "2.00×", True, True),
        ("fastest global peer", "3.5×", True, False),
        ("one pair again", "1.05", True, True),
        ("different pairs", "1.60", False, False),
        ("kNN", "0.25 ms", True, True),
        ("moments", "1.20 ms", False, False),
    ],
)
def test_a_bar_is_met_on_its_own_side(
    report: dict[str, Any], words: str, measured: str, met: bool, aim_met: bool
) -> None:
    found = verdict(report, words)
    assert (found["measured"], found["met"], found["aim_met"]) == (measured, met, aim_met)


def test_bars_of_parts_that_were_not_run_are_left_out(report: dict[str, Any]) -> None:
    assert len(verdicts(report)) == 11
    assert len(BARS) == 19
    report["kernels"]["rows"] = []
    assert len(verdicts(report)) == 7


def test_a_peer_of_higher_recall_is_not_beaten_by_speed(report: dict[str, Any]) -> None:
    assert fastest_global_peer(report) == ("KISS-Matcher + ICP", 3.5, True)
    report["peers"]["rows"]["P1/noise_0.01"]["kiss_matcher_icp"]["recall"] = 0.95
    assert fastest_global_peer(report) == ("KISS-Matcher + ICP", 3.5, False)
    assert not verdict(report, "fastest global peer")["met"]


def test_the_page_tells_every_part_and_how_it_was_measured(
    report: dict[str, Any], tmp_path: Path
) -> None:
    plots = draw_plots(report, tmp_path)
    page = markdown(report, plots)
    assert set(plots) == {"threads", "latency"}
    for name in plots.values():
        assert (tmp_path / name).read_text(encoding="utf-8").startswith("<?xml")
        assert f"(benchmark/{name})" in page
    for words in ("A processor", "x86-64-v3", "GNU 12", "torch 2.13.0", "abc1234", "TEASER++"):
        assert words in page
    assert "| `mean_neighbours/1024` | 250 µs |" in page
    assert "| KISS-Matcher + ICP | 30.0 (10.0–90.0) | 35.0 | 35.0 | 3.5× |" in page
    assert "Time against points" not in page
    lines = page.splitlines()
    for before, line in zip(lines, lines[1:], strict=False):
        if before.startswith("|") and line.startswith("|"):
            assert before.count("|") == line.count("|"), line


def test_pictures_are_the_same_for_the_same_figures(report: dict[str, Any], tmp_path: Path) -> None:
    for name in ("first", "second"):
        draw_plots(report, tmp_path / name)
    for picture in (tmp_path / "first").iterdir():
        assert picture.read_bytes() == (tmp_path / "second" / picture.name).read_bytes()


def test_series_are_split_by_what_stands_before_the_number() -> None:
    times = {"a/1": {"median": 2.0}, "b c/1": {"median": 3.0}, "a/2": {"median": 4.0}}
    assert series(times) == {"a": ([1, 2], [2.0, 4.0]), "b c": ([1], [3.0])}


def test_the_page_tells_what_batches_cost(report: dict[str, Any], tmp_path: Path) -> None:
    quartiles = {"q1": 1.8, "q3": 2.0}
    report["batch"] = {
        "points": 1024,
        "pairs": 240,
        "part_rows": 30,
        "ms": {"1": {"median": 3000.0}, "2": {"median": 1600.0}},
        "gain": {"median": 1.875, **quartiles},
        "part_ms": 7.1,
        "row_bytes": 166.0,
        "client": {"pairs_per_s": 225_000.0, "parts": 20, "grown_mb": 15.0},
    }
    report["measured"]["batch"] = report["measured"]["kernels"]
    report["measured"]["batch"]["settings"]["batch_rounds"] = 5
    page = markdown(report, {})
    assert "| 1 | 3,000 | 80.0 | 12.5 |" in page
    assert "| 2 | 1,600 | 150 | 13.3 |" in page
    assert "Gain of the second worker: 1.88×" in page and "a row 166 bytes" in page
    assert verdict(report, "two worker processes")["met"]


def test_the_page_tells_what_processes_gain(report: dict[str, Any]) -> None:
    page = markdown(report, {})
    assert "2 processes of one thread" in page
    assert "got through 1.60 times the calls of one" in page


def test_the_page_tells_what_waiting_costs(report: dict[str, Any]) -> None:
    page = markdown(report, {})
    assert "| spin, then sleep | 1 | 2 | 6.00 | 7.00 | 8.50 |" in page
    assert "| sleep | 0 | 1 | 6.00 | 7.00 | 8.50 |" in page
