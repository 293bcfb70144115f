"""Takes an animated picture of a viewer's page: take_picture.py VIEW.html PICTURE.webp

The source comes to the target, then both turn once. The page is drawn by the Chromium on the path.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

SIZE = {"width": 1100, "height": 620}
MOTION_FRAMES, TURN_FRAMES = 24, 36
FRAME_MS, REST_MS = 60, 900
SOFTWARE = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def frame(page: Page) -> Image.Image:
    page.evaluate("() => { vnregViewer.drawAll(); return new Promise(requestAnimationFrame); }")
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def frames(page: Page) -> Iterator[tuple[Image.Image, int]]:
    """Pictures, and how long each is shown, in milliseconds."""
    for i in range(MOTION_FRAMES + 1):
        share = i / MOTION_FRAMES
        page.evaluate("share => vnregViewer.setShare(share)", share * share * (3 - 2 * share))
        yield frame(page), REST_MS if i in (0, MOTION_FRAMES) else FRAME_MS
    for _ in range(TURN_FRAMES):
        page.evaluate("degrees => vnregViewer.orbit(degrees, 0)", 360 / TURN_FRAMES)
        yield frame(page), FRAME_MS


def main() -> None:
    view, picture = Path(sys.argv[1]), Path(sys.argv[2])
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"),
            args=SOFTWARE,
            chromium_sandbox=os.getuid() != 0,
        )
        page = browser.new_page(viewport=SIZE, color_scheme="light")
        page.goto(view.resolve().as_uri())
        page.wait_for_function("globalThis.vnregViewer !== undefined")
        images, times = zip(*frames(page), strict=True)
        browser.close()
    half = [image.resize((SIZE["width"] * 2 // 3, SIZE["height"] * 2 // 3)) for image in images]
    half[0].save(picture, save_all=True, append_images=half[1:], duration=times, loop=0, quality=55)


if __name__ == "__main__":
    main()
