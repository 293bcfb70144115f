"""The browser, and pairs to look at."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page, sync_playwright
from viewer_pictures import Opened

import vnreg

ROOT = Path(__file__).resolve().parents[3]
MUG = ROOT / "examples" / "data"

# WebGL in software, as on a machine without a graphics card.
SOFTWARE = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
VIEWER_IS_UP = "globalThis.vnregViewer !== undefined"


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Debian's Chromium, or the one that VNREG_CHROMIUM names; without a window or a network."""
    program = os.environ.get("VNREG_CHROMIUM") or shutil.which("chromium")
    assert program is not None, "no chromium: `make test` installs it"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program, args=SOFTWARE, chromium_sandbox=os.getuid() != 0
        )
        yield browser
        browser.close()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Opened]:
    """Opens a file in a new page. At the end: nothing was complained of, nothing requested."""
    problems: list[str] = []
    contexts = []

    def open_file(path: Path, wait_for: str = VIEWER_IS_UP, **options: Any) -> Page:
        settings: dict[str, Any] = {"viewport": {"width": 900, "height": 600}, **options}
        context = browser.new_context(offline=True, **settings)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(20_000)
        page.on("console", lambda m: problems.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: problems.append(str(error)))
        url = path.resolve().as_uri()
        page.on(
            "request",
            lambda r: (
                problems.append(r.url) if r.url != url and not r.url.startswith("data:") else None
            ),
        )
        page.goto(url)
        page.wait_for_function(wait_for)
        return page

    yield open_file
    for context in contexts:
        context.close()
    assert problems == []


@pytest.fixture(scope="session")
def mug() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The example pair, (1200, 3) and (1000, 3)."""
    return np.loadtxt(MUG / "mug_1.xyz"), np.loadtxt(MUG / "mug_2.xyz")


@pytest.fixture(scope="session")
def mug_file(
    mug: tuple[NDArray[np.float64], NDArray[np.float64]],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """The page of the example pair."""
    page = vnreg.view(*mug, source_name="mug_1.xyz", target_name="mug_2.xyz")
    return page.save(tmp_path_factory.mktemp("view") / "mug.html")
