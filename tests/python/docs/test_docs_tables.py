"""The figures of README.md and docs/batch.md are those of the committed JSON."""

from __future__ import annotations

import copy
import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "docs"))
import page_tables

ROOT = page_tables.ROOT
Json = dict[str, Any]


def load(name: str) -> Json:
    found: Json = json.loads((ROOT / "docs" / name).read_text(encoding="utf-8"))
    return found


RESULTS, BENCHMARK = load("results/results.json"), load("benchmark/benchmark.json")
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", page_tables.PAGES)
def test_the_tables_of_a_page_are_those_of_the_json(name: str) -> None:
    """`python docs/page_tables.py` writes them; `make evaluate` and `make bench` call it."""
    page = (ROOT / name).read_text(encoding="utf-8")
    assert page_tables.with_tables(page, RESULTS, BENCHMARK) == page


def test_every_table_is_on_a_page_once() -> None:
    pages = [(ROOT / name).read_text(encoding="utf-8") for name in page_tables.PAGES]
    names = [found[1] for page in pages for found in page_tables.MARKED.findall(page)]
    assert sorted(names) == sorted(page_tables.TABLES)


@pytest.mark.parametrize(
    ("path", "page"),
    [
        (("rows", "P1/noise_0.01", "kiss_matcher_icp", "symmetric", "5 deg, 0.2", "recall"), 0),
        (("rows", "P0/partial/180", "verified", "plain", "5 deg, 0.2", "recall"), 0),
        (("rows", "views/two_scans", "paper", "ms", "median"), 0),
        (("batch", "gain", "median"), 0),
        (("latency", "series", "different pairs", "tail", "p99"), 0),
        (("batch", "ms", "2", "median"), 1),
        (("batch", "row_bytes"), 1),
        (("batch", "part_ms"), 1),
    ],
)
def test_another_figure_makes_another_page(path: tuple[str, ...], page: int) -> None:
    """So the comparison above cannot pass for figures that are not the JSON's."""
    changed = [copy.deepcopy(RESULTS), copy.deepcopy(BENCHMARK)]
    of: Any = next(found for found in changed if path[0] in found)
    for key in path[:-1]:
        of = of[key]
    of[path[-1]] = 0.5 * of[path[-1]]  # not more: a recall may be 1
    text = (ROOT / page_tables.PAGES[page]).read_text(encoding="utf-8")
    assert page_tables.with_tables(text, *changed) != text


def test_the_sentences_of_the_readme_say_what_the_json_says() -> None:
    """Rounded as they are there."""
    trust = RESULTS["pooled"]["verified"]["P1"]["confidence"]
    shapes = RESULTS["about"]["shapes"]
    text = " ".join(README.split())
    assert (
        f"expected calibration error {trust['ece']:.3f}, area under ROC {trust['auroc']:.2f}"
        in text
    )
    assert f"on {shapes} test shapes" in text
    assert f"{(ROOT / 'models/vnreg.vnr').stat().st_size / 1000:.0f} kB" in text


def test_the_readme_is_under_two_screens() -> None:
    """Of 55 lines each, none so long that it wraps, but for rows of tables."""
    lines = README.splitlines()
    assert len(lines) <= 110
    assert max(len(line) for line in lines if not line.startswith("|")) <= 132


def test_pages_without_tables_stay_as_they_are() -> None:
    text = "# A page\n\n| a |\n|---|\n"
    assert page_tables.with_tables(text, RESULTS, BENCHMARK) == text
    with pytest.raises(KeyError):
        page_tables.with_tables("<!-- table none: x -->\n<!-- end -->", RESULTS, BENCHMARK)
    assert re.search(
        r"^\| ",
        page_tables.with_tables("<!-- table cost: x -->\n<!-- end -->", {}, BENCHMARK),
        re.M,
    )
