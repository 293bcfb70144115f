"""The page as a file: from the program, from Python, and what it is made of."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vnreg

ROOT = Path(__file__).resolve().parents[3]
MUG = ROOT / "examples" / "data"
Pair = tuple[NDArray[np.float64], NDArray[np.float64]]

THREE = ROOT / "viewer" / "third_party" / "three.js"
# make_three.sh beside it makes this one.
THREE_SHA256 = "166d94e979ab3c240483c233626c528c290d9c87fe6c1108a6298772ba579d55"


def data_of(page: str) -> dict[str, Any]:
    match = re.search(r'<script type="application/json" id="pair">(.*?)</script>', page, re.S)
    assert match is not None
    data: dict[str, Any] = json.loads(match[1])
    return data


def run(*arguments: str | Path, cwd: Path = MUG) -> subprocess.CompletedProcess[bytes]:
    program = os.environ.get("VNREG_CLI", ROOT / "build" / "release" / "vnreg")
    command = [program, "align", *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, check=False)


def test_program_and_python_write_the_same_page(mug: Pair, tmp_path: Path) -> None:
    file = tmp_path / "view.html"
    done = run("mug_1.xyz", "mug_2.xyz", "--html", file, "--threads", "1")
    assert (done.returncode, done.stderr) == (0, b"")
    registrar = vnreg.Registrar()
    result = registrar.align(*mug)
    view = vnreg.view(
        *mug,
        result,
        registrar.explain(),
        source_name="mug_1.xyz",
        target_name="mug_2.xyz",
        model="vnreg",
        mode="verified",
    )
    pages = [file.read_text(encoding="utf-8"), view.html]
    datas = [data_of(page) for page in pages]
    for data in datas:
        assert set(data["result"].pop("ms")) == set(result.ms)
    assert datas[0] == datas[1]
    empty = [re.sub(r'(id="pair">).*?(</script>)', r"\1\2", page, flags=re.S) for page in pages]
    assert empty[0] == empty[1]
    # Asked without an explanation, it finds the same one again.
    again = json.loads(vnreg.view(*mug, result).data)
    assert again["explanation"] == datas[0]["explanation"]


def test_names_that_are_not_utf8(tmp_path: Path) -> None:
    odd = tmp_path / os.fsdecode(b"m\xffg<\xc3.xyz")
    odd.write_bytes((MUG / "mug_1.xyz").read_bytes())
    file = tmp_path / "view.html"
    assert run(odd, MUG / "mug_2.xyz", "--html", file).returncode == 0
    assert data_of(file.read_text(encoding="utf-8"))["source"]["name"].endswith(
        "m\ufffdg<\ufffd.xyz"
    )


@pytest.mark.parametrize("place", ["/dev/full", "missing/view.html", "."])
def test_a_page_that_cannot_be_written(tmp_path: Path, place: str) -> None:
    files = [MUG / "mug_1.xyz", MUG / "mug_2.xyz"]
    done = run(*files, "--html", place, cwd=tmp_path)
    assert done.returncode == 1 and done.stdout == b""
    assert done.stderr.startswith(f"vnreg: {place}: ".encode())
    assert done.stderr.count(b"\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_view_object(mug: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    view = vnreg.view(*mug)
    assert "<" not in view.data
    assert view.html == vnreg.view_template().replace(vnreg.VIEW_PLACEHOLDER, view.data)
    assert vnreg.view_template().count(vnreg.VIEW_PLACEHOLDER) == 1
    assert view.save(tmp_path / "a.html").read_text(encoding="utf-8") == view.html
    assert view._repr_html_().startswith("<iframe ")
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    path = view.open()
    assert opened == [path.as_uri()] and path.read_text(encoding="utf-8") == view.html
    path.unlink()
    path.parent.rmdir()


def test_prepared_clouds_are_refused(mug: Pair) -> None:
    prepared = vnreg.Registrar().prepare(mug[1])
    with pytest.raises(TypeError, match="target: expected points"):
        vnreg.view(mug[0], prepared)


def test_shown_points_are_the_clouds_own(mug: Pair) -> None:
    data = json.loads(vnreg.view(*mug).data)
    for name, cloud in zip(("source", "target"), mug, strict=True):
        relative = np.frombuffer(base64.b64decode(data[name]["xyz"]), np.float32).reshape(-1, 3)
        shown = relative + np.array(data[name]["origin"])
        order = np.lexsort(shown.round(5).T), np.lexsort(cloud.round(5).T)
        np.testing.assert_allclose(shown[order[0]], cloud[order[1]], atol=1e-6)


def test_the_page_asks_for_nothing(mug: Pair) -> None:
    template = vnreg.view_template()
    own = template.replace(THREE.read_text(encoding="utf-8"), "")
    assert len(own) < 100_000
    assert not re.search(r"https?://|\bsrc=|@import|fetch\(|XMLHttpRequest", own)
    assert "The MIT License" in template and "three.js authors" in template


def test_three_js_is_the_one_that_was_reviewed() -> None:
    content = THREE.read_bytes()
    assert hashlib.sha256(content).hexdigest() == THREE_SHA256
    assert b"</script" not in content


def test_the_script_is_made_from_its_sources(tmp_path: Path) -> None:
    made = tmp_path / "view.js"
    subprocess.run([ROOT / "viewer" / "make_view.sh", made], check=True)
    assert made.read_text(encoding="utf-8") == (ROOT / "viewer" / "view.js").read_text(
        encoding="utf-8"
    ), "viewer/view.js is stale: make viewer"
