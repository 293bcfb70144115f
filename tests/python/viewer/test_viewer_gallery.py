"""The gallery of failures in the browser: a click opens the viewer on that pair."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page

import vnreg
from vnreg_train.evaluate.gallery import Card, gallery_page
from vnreg_train.evaluate.thumbnail import thumbnail

Clouds = tuple[NDArray[np.float64], NDArray[np.float64]]


@pytest.fixture
def gallery(mug: Clouds, tmp_path: Path) -> Path:
    """Two cards: the mugs, and the mugs the other way round."""
    source, target = mug
    cards = [
        Card(
            title=f"pair {name}",
            row=f"P1/{name}",
            category="Kitchen",
            kind="twin",
            facts={"status": "ok"},
            picture=thumbnail(b, [("as found", a), ("right", a)]),
            data=vnreg.view(a, b, source_name=f"source of {name}").data,
        )
        for name, a, b in (("one", source, target), ("two", target, source))
    ]
    path = tmp_path / "gallery.html"
    path.write_text(gallery_page(cards, "The worst pairs", "Two."), encoding="utf-8")
    return path


def test_a_click_opens_the_pair_and_escape_closes_it(
    open_page: Callable[..., Page], gallery: Path
) -> None:
    page = open_page(gallery, wait_for="document.querySelector('output').value === '2 pairs'")
    page.set_default_timeout(60_000)  # two viewers one after the other, drawn by software
    page.get_by_role("button", name="Open in 3D").nth(1).click()
    viewer = page.frame_locator("dialog iframe")
    viewer.get_by_role("heading", name="source of two").wait_for()
    page.keyboard.press("Escape")
    page.locator("iframe").wait_for(state="detached")
    page.get_by_label("row").select_option("P1/one")
    assert page.locator("article:visible").count() == 1
    page.get_by_role("button", name="Open in 3D").click()
    viewer.get_by_role("heading", name="source of one").wait_for()
    page.get_by_role("button", name="Close").click()
    page.locator("iframe").wait_for(state="detached")


def test_a_phone_shows_no_sideways_scroll(open_page: Callable[..., Page], gallery: Path) -> None:
    page = open_page(
        gallery,
        wait_for="document.querySelector('output').value === '2 pairs'",
        viewport={"width": 360, "height": 640},
    )
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
