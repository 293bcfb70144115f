"""docs/paper.md says what its figures say."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from vnreg_train.paper.page import PARTS, markdown, order_sentence, read_figures
from vnreg_train.paper.published import BARS, BASELINES

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "docs" / "paper"


@pytest.fixture(scope="module")
def figures() -> dict[str, Any]:
    docs = ROOT / "docs"
    results, benchmark = docs / "results/results.json", docs / "benchmark/benchmark.json"
    return read_figures(FOLDER, results, benchmark)


def page(figures: dict[str, Any]) -> str:
    return markdown(figures, (FOLDER / "notes.md").read_text(encoding="utf-8"))


def test_the_page_is_made_of_its_figures(figures: dict[str, Any]) -> None:
    written = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
    assert written == page(figures), "run `vnreg-train paper-page`"


def test_every_part_is_there(figures: dict[str, Any]) -> None:
    assert {*PARTS, "results", "kernel_rate"} == set(figures)
    assert len(figures["ablation"]["variants"]) >= 4


def test_a_changed_figure_changes_the_page(figures: dict[str, Any]) -> None:
    changed = copy.deepcopy(figures)
    changed["recall"]["rows"]["P0/noisy/90"]["paper"]["plain"]["5 deg, 0.2"]["recall"] = 0.123
    changed["speed"]["networks"]["paper"]["ratio"] = 9.87
    assert "12.3 (" in page(changed) and "9.87" in page(changed)


def test_the_paper_and_its_baselines_are_told_as_published(figures: dict[str, Any]) -> None:
    text = page(figures)
    assert len(BASELINES) == 5 and set(BARS) == {"clean", "noisy", "independent", "partial"}
    assert "| RPMNet, from the paper | 91.4 | 62 | 33.8 | 25.5 |" in text
    assert "| the paper | 90.6 | 89.5 | 89.9 | 90.2 |" in text


def test_the_order_is_judged(figures: dict[str, Any]) -> None:
    found: dict[str, Any] = {"variants": {}}
    hits = {"neither": 1, "invariant": 2, "vectors": 3, "both": 4, "shared": 4}
    for name, count in hits.items():
        found["variants"][name] = {"recall": {"fine": {"hits": count}}}
    assert "**met**" in order_sentence(found)
    found["variants"]["vectors"]["recall"]["fine"]["hits"] = 5
    assert "**missed**" in order_sentence(found)
    del found["variants"]["both"]
    assert "not trained: both." in order_sentence(found)


def test_figures_are_json_of_finite_numbers() -> None:
    for path in FOLDER.glob("*.json"):
        text = path.read_text(encoding="utf-8")
        assert "NaN" not in text and "Infinity" not in text
        json.loads(text)
