"""An alignment as a page to look at."""

from __future__ import annotations

import html
import os
import tempfile
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np

from vnreg._vnreg import (
    VIEW_PLACEHOLDER,
    Explanation,
    PreparedCloud,
    Registrar,
    Result,
    _view_data,
    view_template,
)


class View:
    """A page that shows two clouds and what was found: one HTML file that needs no network.

    In a notebook it shows itself.
    """

    def __init__(self, data: str) -> None:
        self._data = data

    @property
    def data(self) -> str:
        """What the page shows, JSON without any `<`: it may stand in a script of another page."""
        return self._data

    @property
    def html(self) -> str:
        """The page: about 0.6 MB, and at most 5 MB with the largest clouds."""
        return view_template().replace(VIEW_PLACEHOLDER, self._data, 1)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the page to a file and returns its path."""
        file = Path(path)
        file.write_text(self.html, encoding="utf-8")
        return file

    def open(self) -> Path:
        """Opens the page, from a temporary file that stays, in the browser; returns its path."""
        path = Path(tempfile.mkdtemp(prefix="vnreg-")) / "view.html"
        webbrowser.open(self.save(path).as_uri())
        return path

    def _repr_html_(self) -> str:
        return (
            f'<iframe title="vnreg" srcdoc="{html.escape(self.html)}" '
            'style="width: 100%; height: 640px; border: 0"></iframe>'
        )


def view(
    source: Any,
    target: Any,
    result: Result | None = None,
    explanation: Explanation | None = None,
    *,
    source_name: str = "source",
    target_name: str = "target",
    model: str = "",
    mode: str = "",
) -> View:
    """A page that shows `source` (N, 3), `target` (M, 3) and the pose between them.

    result: None aligns them first, by the built-in model. explanation: Registrar.explain() after
    the align that gave the result: matches, significances, hypotheses. Without it they are shown
    where the built-in model finds the same pose, bit by bit, when it is asked again. The names of
    clouds, model and mode are shown, nothing else is done with them.

    Of a cloud with more than 100,000 points so many are shown, an even sample. Points that are not
    finite are left out. Raises TypeError for a PreparedCloud (give its points), else as align does.
    """
    for name, cloud in (("source", source), ("target", target)):
        if isinstance(cloud, PreparedCloud):
            raise TypeError(f"{name}: expected points, got a PreparedCloud")
    if explanation is None:
        found, found_explanation, found_model = _align_again(source, target, result)
        if result is None or _same_pose(result, found):
            result, explanation = found, found_explanation
            model, mode = model or found_model, mode or "verified"
    assert result is not None
    data = _view_data(source, target, result, explanation, source_name, target_name, model, mode)
    return View(data)


def _align_again(
    source: Any, target: Any, result: Result | None
) -> tuple[Result, Explanation, str]:
    """What the built-in model says, and its name."""
    dropped = result is not None and result.dropped_source + result.dropped_target > 0
    registrar = Registrar(drop_non_finite=dropped)
    found = registrar.align(source, target)
    return found, registrar.explain(), "vnreg"


def _same_pose(a: Result, b: Result) -> bool:
    return a.has_pose and np.array_equal(a.T_target_source, b.T_target_source)
