"""The page in a browser without a network: what it shows, and how it is used."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Page
from viewer_pictures import Opened, blocks, drawn, middle, picture, state

import vnreg

REFERENCE = Path(__file__).resolve().parents[2] / "data" / "viewer" / "mug.png"
# Mean difference of the blocks' colours: other fonts and drivers stay below, another pose is above.
ALIKE = 0.01

Pair = tuple[NDArray[np.float64], NDArray[np.float64]]


def wait_for_share(page: Page, share: float) -> None:
    page.wait_for_function(f"Math.abs(vnregViewer.state().share - {share}) < 1e-9")


def test_tells_what_was_found(open_page: Opened, mug_file: Path, mug: Pair) -> None:
    page = open_page(mug_file)
    result = vnreg.align(*mug)
    assert page.locator("#names").inner_text() == "mug_1.xyz → mug_2.xyz"
    assert page.locator("#status").inner_text() == "ok"
    facts = page.locator("#facts").inner_text()
    assert f"{round(100 * result.confidence)} %" in facts
    assert f"{round(100 * result.overlap)} %" in facts
    assert page.locator(".time").count() == sum(
        value > 0 for name, value in result.ms.items() if name != "total"
    )
    assert page.locator(".pose").count() > len(result.alternatives)


def test_slider_moves_the_source(open_page: Opened, mug_file: Path, mug: Pair) -> None:
    page = open_page(mug_file)
    page.evaluate("vnregViewer.orbit(0, 0)")  # the camera stays where it is from now on
    page.keyboard.press("t")  # the source alone
    seen = {}
    for share in (0, 0.5, 1):
        page.locator("#slider").fill(str(round(1000 * share)))
        wait_for_share(page, share)
        seen[share] = (middle(picture(page)), np.array(state(page)["sourceMatrix"]))
    for a, b in ((0, 0.5), (0.5, 1)):
        assert np.linalg.norm(seen[a][0] - seen[b][0]) > 10  # pixels
        assert np.abs(seen[a][1] - seen[b][1]).max() > 0.1
    # Column-major: the turn of the start is none, that of the end is the answer's.
    turns = {share: m.reshape(4, 4).T[:3, :3] for share, (_, m) in seen.items()}
    scale = np.cbrt(np.linalg.det(turns[0]))
    np.testing.assert_allclose(turns[0] / scale, np.eye(3), atol=1e-9)
    T = vnreg.align(*mug).T_target_source
    np.testing.assert_allclose(turns[1] / scale, T[:3, :3], atol=1e-6)
    # Half of the way is half of the turn: rigid, in between.
    half = turns[0.5] / scale
    np.testing.assert_allclose(half @ half, T[:3, :3], atol=1e-6)


def test_aligned_clouds_lie_on_each_other(open_page: Opened, mug_file: Path) -> None:
    page = open_page(mug_file)
    page.evaluate("vnregViewer.orbit(0, 0)")
    page.keyboard.press("t")
    source = drawn(picture(page))
    page.keyboard.press("t")
    page.keyboard.press("s")
    target = drawn(picture(page))
    coarse = [
        blocks(np.repeat(mask[..., None], 3, 2).astype(float)) > 0 for mask in (source, target)
    ]
    shared = (coarse[0] & coarse[1]).sum() / (coarse[0] | coarse[1]).sum()
    assert shared > 0.8


def test_play_and_pause(open_page: Opened, mug_file: Path) -> None:
    page = open_page(mug_file)
    page.locator("#play").click()
    page.wait_for_function("vnregViewer.state().share > 0.02 && vnregViewer.state().share < 1")
    page.locator("#play").click()
    paused = state(page)
    assert not paused["playing"] and 0 < paused["share"] < 1
    page.wait_for_timeout(100)
    assert state(page)["share"] == paused["share"]
    page.locator("#play").click()
    wait_for_share(page, 1)


def test_play_jumps_where_motion_is_not_wanted(open_page: Opened, mug_file: Path) -> None:
    page = open_page(mug_file, reduced_motion="reduce")
    page.keyboard.press("b")
    page.keyboard.press("p")
    assert state(page)["share"] == 1


def test_list_switches_poses(open_page: Opened, mug_file: Path) -> None:
    page = open_page(mug_file, reduced_motion="reduce")
    answer, shown = np.array(state(page)["sourceMatrix"]), picture(page)
    data = json.loads(page.locator("#pair").text_content() or "")
    hypotheses = data["explanation"]["hypotheses"]
    last = len(hypotheses) - 1  # the first of the others may be a twin, and look alike
    assert last >= 1
    other = page.locator(".pose").nth(last)
    other.click()
    assert state(page)["pose"] == last
    assert other.get_attribute("aria-pressed") == "true"
    assert page.locator(".pose").nth(0).get_attribute("aria-pressed") == "false"
    m = np.array(state(page)["sourceMatrix"]).reshape(4, 4).T[:3, :3]
    turn = m / np.cbrt(np.linalg.det(m))
    expected = np.array(hypotheses[last]["pose"]).reshape(4, 4)[:3, :3]
    np.testing.assert_allclose(turn, expected, atol=1e-6)
    assert np.abs(blocks(picture(page)) - blocks(shown)).mean() > ALIKE
    page.locator(".pose").nth(0).click()
    np.testing.assert_allclose(state(page)["sourceMatrix"], answer, atol=1e-12)


def test_colours(open_page: Opened, mug_file: Path) -> None:
    page = open_page(mug_file)
    plain = picture(page)
    page.locator("#colour-residual").check()
    page.wait_for_timeout(500)  # residuals are measured a part at a time
    residual = picture(page)
    page.locator("#colour-significance").check()
    significance = picture(page)
    for a, b in ((plain, residual), (residual, significance), (significance, plain)):
        assert np.abs(a - b).max(axis=2)[drawn(a) | drawn(b)].mean() > 0.1


def test_residuals_are_those_of_the_chosen_pose(open_page: Opened, mug_file: Path) -> None:
    """Where the clouds lie on each other, few points have the colour of large residuals."""

    def red(page: Page) -> float:
        page.wait_for_timeout(700)
        pixels = picture(page)
        marked = (pixels[..., 0] > pixels[..., 1] + 0.3) & (pixels[..., 0] > pixels[..., 2] + 0.3)
        return float(marked.sum() / drawn(pixels).sum())

    page = open_page(mug_file, reduced_motion="reduce")
    page.keyboard.press("2")
    right = red(page)
    reds = []
    for _ in json.loads(page.locator("#pair").text_content() or "")["explanation"]["hypotheses"][
        1:
    ]:
        page.keyboard.press("j")
        reds.append(red(page))
    assert min(reds) > right  # a twin lays most points right, too
    assert max(reds) > 1.5 * right


def test_matches(open_page: Opened, mug_file: Path) -> None:
    page = open_page(mug_file)
    page.keyboard.press("b")
    without = drawn(picture(page)).sum()
    page.locator("#show-matches").check()
    assert drawn(picture(page)).sum() > 1.2 * without
    assert page.locator("#matches-count").inner_text().endswith("of 256 agree)")


def test_keyboard(open_page: Opened, mug_file: Path) -> None:
    page = open_page(mug_file)
    order = []
    for _ in range(5):
        page.keyboard.press("Tab")
        order.append(page.evaluate("document.activeElement.id"))
    assert order == ["canvas", "play", "slider", "colour-plain", "show-source"]
    page.locator("#canvas").focus()
    for key in ("ArrowLeft", "ArrowUp", "+"):
        before = state(page)["camera"]
        page.keyboard.press(key)
        assert state(page)["camera"] != before, key
    page.keyboard.press("Home")
    for key, name, value in (
        ("b", "share", 0),
        ("a", "share", 1),
        ("2", "colour", "residual"),
        ("3", "colour", "significance"),
        ("1", "colour", "plain"),
        ("j", "pose", 1),
        ("k", "pose", 0),
        ("d", "dark", True),
    ):
        page.keyboard.press(key)
        assert state(page)[name] == value, key
    for key, name in (("s", "source"), ("t", "target"), ("g", "ghost"), ("m", "matches")):
        before = state(page)["shown"][name]
        page.keyboard.press(key)
        assert state(page)["shown"][name] is not before, key
    page.locator(".pose").nth(1).focus()
    page.keyboard.press("Enter")
    assert state(page)["pose"] == 1
    page.locator("#slider").focus()
    share = state(page)["share"]
    page.keyboard.press("ArrowLeft")
    assert state(page)["share"] < share


def test_the_mouse_orbits(open_page: Opened, mug_file: Path) -> None:
    page = open_page(mug_file)
    before, seen = state(page)["camera"], picture(page)
    page.mouse.move(250, 250)
    page.mouse.down()
    page.mouse.move(350, 280, steps=5)
    page.mouse.up()
    assert np.linalg.norm(np.subtract(state(page)["camera"], before)) > 0.5
    assert np.abs(blocks(picture(page)) - blocks(seen)).mean() > ALIKE / 2


@pytest.mark.parametrize("width", [320, 390])
def test_on_a_phone(open_page: Opened, mug_file: Path, width: int) -> None:
    page = open_page(
        mug_file, viewport={"width": width, "height": 700}, has_touch=True, is_mobile=True
    )
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert drawn(picture(page)).sum() > 500
    for name in ("#play", "#slider", "#theme", ".pose"):
        box = page.locator(name).first.bounding_box()
        assert box is not None and box["height"] >= 32, name
        assert box["x"] >= 0 and box["x"] + box["width"] <= width, name
    page.locator(".pose").nth(1).tap()
    assert state(page)["pose"] == 1


def test_dark_and_light(open_page: Opened, mug_file: Path) -> None:
    paper = "getComputedStyle(document.body).backgroundColor"
    light = open_page(mug_file, color_scheme="light")
    dark = open_page(mug_file, color_scheme="dark")
    assert (state(light)["dark"], state(dark)["dark"]) == (False, True)
    assert picture(light)[0, 0].mean() > 0.9 and picture(dark)[0, 0].mean() < 0.2
    assert light.evaluate(paper) != dark.evaluate(paper)
    dark.locator("#theme").click()
    assert dark.evaluate(paper) == light.evaluate(paper)
    np.testing.assert_allclose(blocks(picture(dark)), blocks(picture(light)), atol=0.02)


def test_looks_as_it_did(open_page: Opened, mug_file: Path) -> None:
    page = open_page(mug_file, color_scheme="light")
    seen = picture(page)
    if os.environ.get("VNREG_WRITE_PICTURES"):  # to look at and commit
        Image.fromarray((255 * seen).astype(np.uint8)).save(REFERENCE, optimize=True)
    expected = np.asarray(Image.open(REFERENCE).convert("RGB"), np.float64) / 255
    assert np.abs(blocks(seen) - blocks(expected)).mean() < ALIKE
    page.keyboard.press("b")
    assert np.abs(blocks(picture(page)) - blocks(expected)).mean() > ALIKE
