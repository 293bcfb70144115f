"""What the picture shows, read from its pixels."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Page

Pixels = NDArray[np.float64]
Opened = Callable[..., Page]
"""Opens a file in a browser: (path, **settings of the context)."""


def state(page: Page) -> dict[str, Any]:
    """The page's own account of what it shows."""
    found: dict[str, Any] = page.evaluate("vnregViewer.state()")
    return found


def picture(page: Page, draw_all: bool = True) -> Pixels:
    """(height, width, 3) 0..1: the canvas without what is written over it.

    draw_all: with all points, at once; else as it is.
    """
    page.add_style_tag(content="#legend, #note { display: none }")
    if draw_all:
        page.evaluate("() => { vnregViewer.drawAll(); return new Promise(requestAnimationFrame); }")
    image = Image.open(io.BytesIO(page.locator("#canvas").screenshot()))
    return np.asarray(image.convert("RGB"), np.float64) / 255


def drawn(pixels: Pixels) -> NDArray[np.bool_]:
    """Which pixels differ from the background, the corner's colour."""
    return np.asarray(np.abs(pixels - pixels[0, 0]).max(axis=2) > 0.1)


def middle(pixels: Pixels) -> NDArray[np.float64]:
    """Mean (row, column) of what is drawn."""
    return np.argwhere(drawn(pixels)).mean(axis=0)


def blocks(pixels: Pixels, size: int = 20) -> Pixels:
    """Mean colours of squares of `size` pixels: what is left when single points are looked over."""
    rows, columns = (n // size for n in pixels.shape[:2])
    cut = pixels[: rows * size, : columns * size]
    return cut.reshape(rows, size, columns, size, 3).mean(axis=(1, 3))
