"""The worst pairs of a run, and the page that shows them."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shipped import SHIPPED

import vnreg
from vnreg_train.cli import parser
from vnreg_train.evaluate import commands
from vnreg_train.evaluate.gallery import Card, gallery_page
from vnreg_train.evaluate.rows import ROWS
from vnreg_train.evaluate.run import Pairing, answers
from vnreg_train.evaluate.thumbnail import SIZE, thumbnail
from vnreg_train.evaluate.worst_pairs import worst_pairs

ROW = ROWS["P1/partial_75"]
OTHER = ROWS["P0/clean/45"]


class Page(HTMLParser):
    """What a browser makes of a page: its cards' facts and scripts, and all that it refers to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.cards: list[dict[str, str]] = []
        self.scripts: dict[str, str] = {}
        self.tags: list[str] = []
        self.links: list[str] = []
        self._at, self._term, self._script = "", "", ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.tags.append(tag)
        self.links += [given[name] for name in ("src", "href") if name in given]
        if tag == "article":
            self.cards.append({k.removeprefix("data-"): v for k, v in given.items()})
        self._at, self._script = tag, given.get("id", "")

    def handle_endtag(self, tag: str) -> None:
        self._at = ""

    def handle_data(self, data: str) -> None:
        if self._at == "script" and self._script:
            self.scripts[self._script] = data
        elif self._at == "dt":
            self._term = data
        elif self._at == "dd":
            self.cards[-1][self._term] = data
        elif self._at == "h2":
            self.cards[-1]["title"] = data


@pytest.fixture
def run(data_folder: Path, known_method: Any, tmp_path: Path) -> Path:
    """Mode verified wrong on three of twelve pairs."""
    pairing = Pairing("validation", data=data_folder)
    answers(known_method({0: 1, 1: 1, 2: 40, 3: 1, 4: 1, 5: 90}), ROW, pairing, tmp_path / "run")
    answers(known_method({0: 1, 1: 1, 2: 1, 3: 1, 4: 1}), OTHER, pairing, tmp_path / "run")
    return tmp_path / "run"


def test_the_worst_pairs_are_the_wrong_ones_the_farthest_first(
    run: Path, data_folder: Path, known_method: Any
) -> None:
    found = worst_pairs(run, "verified", [ROW, OTHER], data_folder, {}, 9, "error")
    assert [(w.row.name, w.pair.shape) for w in found] == [
        (OTHER.name, 5),  # no pose
        (ROW.name, 5),
        (ROW.name, 2),
    ]
    assert found[0].kind == "no pose"
    assert found[1].scores.symmetric_rotation_deg[0] == pytest.approx(90, abs=1e-4)
    expected = Pairing("validation", data=data_folder).pairs(ROW)
    np.testing.assert_array_equal(found[2].pair.source, [*expected][2].source)
    surest = worst_pairs(run, "verified", [ROW, OTHER], data_folder, {}, 2, "confidence")
    assert [w.pair.shape for w in surest] == [5, 2] and surest[0].row == ROW
    with pytest.raises(ValueError, match="no answers of coarse"):
        worst_pairs(run, "coarse", [ROW], data_folder, {}, 9, "error")


def test_the_gallery_shows_the_run_s_answers_and_what_this_engine_says(
    run: Path, data_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "pages" / "gallery.html"
    words = ["gallery", "--run", str(run), "-o", str(out), "--data", str(data_folder)]
    arguments = parser().parse_args([*words, "--order", "error"])
    commands.gallery_main(arguments)
    text = out.read_text(encoding="utf-8")
    assert f"{out}: 3 pairs, {out.stat().st_size / 1e6:.1f} MB" in capsys.readouterr().out
    page = Page(text)
    cards = page.cards
    assert [card["row"] for card in cards] == [OTHER.name, ROW.name, ROW.name]
    assert [card.get("rotation error") for card in cards] == [None, "90.0°", "40.0°"]
    assert [card["status"] for card in cards] == ["degenerate", "ambiguous", "ambiguous"]
    assert cards[1]["confidence"] == "0.20" and cards[1]["right alternative"] == "listed"
    assert cards[1]["kind"] == "other" and cards[1]["pair"] == "validation 5, seed 0"
    # The run's answers are made up: this engine gives its own.
    assert "gives another pose" in cards[1]["this engine"]
    assert page.tags.count("svg") == 3 and page.links == []
    assert not re.search(r"https?://(?!www\.w3\.org)", re.sub(r'id="viewer">.*', "", text))
    for number in range(3):
        data = json.loads(page.scripts[f"pair-{number}"])
        assert data["mode"] == "verified" and data["source"]["given"] == 1024
    template = json.loads(page.scripts["viewer"])
    assert template == vnreg.view_template()
    assert json.loads(page.scripts["placeholder"]) in template


def test_what_the_engine_says_again_is_not_said_twice(data_folder: Path, tmp_path: Path) -> None:
    common = ["--run", str(tmp_path / "run"), "--data", str(data_folder)]
    rows = ["--rows", "P1/partial_50"]
    measured = ["--split", "validation", "--methods", "coarse", "--paper-model", str(SHIPPED)]
    commands.evaluate_main(parser().parse_args(["evaluate", *common, *rows, *measured]))
    out = tmp_path / "gallery.html"
    shown = ["-o", str(out), "--mode", "coarse", "--model", str(SHIPPED), "--count", "2"]
    commands.gallery_main(parser().parse_args(["gallery", *common, *rows, *shown]))
    cards = Page(out.read_text(encoding="utf-8")).cards
    assert len(cards) == 2
    assert all("this engine" not in card and "rotation error" in card for card in cards)


def test_hostile_names_stay_text() -> None:
    name = '</script><img src=x onerror="x">{{cards}}'
    data = vnreg.view(np.eye(3), np.eye(3) * 2, source_name=name).data
    card = Card(name, name, name, name, {name: name}, "<svg></svg>", data)
    page = Page(gallery_page([card, card], name, name))
    assert "img" not in page.tags and page.tags.count("article") == 2
    assert page.cards[0]["title"] == page.cards[0]["row"] == page.cards[0][name] == name
    assert json.loads(page.scripts["pair-1"])["source"]["name"] == name


def test_a_still_shows_both_clouds_in_every_panel_and_inside_it() -> None:
    rng = np.random.default_rng(0)
    target, source = rng.normal(size=(500, 3)), rng.normal(size=(40, 3)) * 2
    svg = thumbnail(target, [("as found", source), ("right", target[:7])])
    paths = re.findall(r'<path class="(\w+)" d="([^"]*)"', svg)
    assert [kind for kind, _ in paths] == ["target", "source", "target", "source"]
    assert [d.count("M") for _, d in paths] == [320, 40, 320, 7]
    for _, d in paths:
        places = np.array(re.findall(r"M(\S+) (\S+?)h0", d), float)
        assert (places >= 0).all() and (places <= SIZE).all()
    assert "as found" in svg and "right" in svg
