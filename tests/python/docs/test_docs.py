"""The site builds from this repository alone, and every code block in the docs runs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

import vnreg

ROOT = Path(__file__).resolve().parents[3]
DOCS = ROOT / "docs"
STRICT = ["-pedantic", "-Wall", "-Wextra", "-Werror"]


@dataclass(frozen=True)
class Block:
    page: str
    line: int
    language: str
    text: str


def blocks_of(path: Path) -> list[Block]:
    """The fenced blocks of a page."""
    text = path.read_text(encoding="utf-8")
    return [
        Block(path.name, text[: match.start()].count("\n") + 1, match[1], match[2])
        for match in re.finditer(r"^```(.*)\n([\s\S]*?)^```$", text, re.M)
    ]


BLOCKS = [block for path in sorted(DOCS.glob("*.md")) for block in blocks_of(path)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the files that the blocks name."""
    for name in ("mug_1.xyz", "mug_2.xyz"):
        shutil.copy(ROOT / "examples/data" / name, tmp_path)
    shutil.copytree(ROOT / "models", tmp_path / "models")
    points = (tmp_path / "mug_1.xyz").read_text(encoding="utf-8")
    head = f"{points.count(chr(10))}\nproperty float x\nproperty float y\nproperty float z\n"
    (tmp_path / "scan.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex {head}end_header\n{points}", encoding="utf-8"
    )
    (tmp_path / "model.pcd").write_text(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH 1200\nHEIGHT 1\nPOINTS 1200\nDATA ascii\n{points}",
        encoding="utf-8",
    )
    return tmp_path


def library_folder() -> Path:
    default = ROOT / "build/release/engine/libvnreg.so"
    path = Path(os.environ.get("VNREG_LIBRARY", default))
    assert path.is_file(), f"no library at {path}: build it, or set VNREG_LIBRARY"
    return path.parent


def run(folder: Path, *command: str | Path, ok: tuple[int, ...] = (0,)) -> str:
    environment = os.environ | {
        "PYTHONPATH": str(Path(vnreg.__file__).parents[1]),
        "LD_LIBRARY_PATH": str(library_folder()),
    }
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode in ok, done.stdout + done.stderr
    return done.stdout


def run_python(block: Block, folder: Path) -> None:
    (folder / "block.py").write_text(block.text, encoding="utf-8")
    run(folder, sys.executable, "block.py")


def run_compiled(block: Block, folder: Path) -> None:
    source = folder / f"block.{block.language}"
    source.write_text(block.text, encoding="utf-8")
    compiler = ["cc", "-std=c99"] if block.language == "c" else ["c++", "-std=c++20"]
    include = f"-I{ROOT / 'engine/include'}"
    library = [f"-L{library_folder()}", "-lvnreg"]
    run(folder, *compiler, *STRICT, include, source, *library, "-o", "block")
    run(folder, folder / "block")


def run_cmake(block: Block, folder: Path) -> None:
    """Against a tree in which the package files are what the build has made of them."""
    (folder / "CMakeLists.txt").write_text(block.text, encoding="utf-8")
    (folder / "main.cpp").write_text(
        "#include <vnreg/vnreg.hpp>\nint main() { return vnreg::version().empty(); }\n",
        encoding="utf-8",
    )
    prefix, build = folder / "prefix", library_folder().parent
    for part in ("runtime", "development"):
        run(folder, "cmake", "--install", build, "--prefix", prefix, "--component", part)
    run(folder, "cmake", "-S", ".", "-B", "b", "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}")
    run(folder, "cmake", "--build", "b")
    run(folder, folder / "b/mine")


def run_shell(block: Block, folder: Path) -> None:
    program = Path(os.environ.get("VNREG_CLI", ROOT / "build/release/vnreg"))
    assert program.is_file(), f"no program at {program}: build it, or set VNREG_CLI"
    for line in block.text.splitlines():
        name, *arguments = line.split()
        assert name == "vnreg", line
        run(folder, program, *arguments, ok=(0, 4))  # 4: a pose, but not a sure one


RUN = {
    "python": run_python,
    "cpp": run_compiled,
    "c": run_compiled,
    "cmake": run_cmake,
    "sh": run_shell,
}


@pytest.mark.parametrize(
    "block",
    [block for block in BLOCKS if block.language != "text"],
    ids=lambda block: f"{block.page}:{block.line}",
)
def test_a_code_block_runs(block: Block, folder: Path) -> None:
    assert block.language in RUN, f"{block.page}:{block.line}: {block.language or 'no language'}"
    RUN[block.language](block, folder)


def test_there_are_blocks_of_every_kind() -> None:
    assert {block.language for block in BLOCKS} >= set(RUN)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "-q", "-d", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not done.stderr.strip(), done.stderr
    return folder


def test_every_page_of_the_site_is_there_and_every_page_is_on_it(site: Path) -> None:
    home = (site / "index.html").read_text(encoding="utf-8")
    for page in DOCS.glob("*.md"):
        name = page.with_suffix(".html").name
        assert (site / name).stat().st_size > 2000
        assert f'href="{name}"' in home or name == "index.html"


def test_the_reference_tells_every_public_name(site: Path) -> None:
    reference = (site / "reference_python.html").read_text(encoding="utf-8")
    for name in set(vnreg.__all__) - {"__version__"}:
        assert f'id="{name.lower()}"' in reference
    assert "vnreg_registrar_prepare" in (site / "reference_c.html").read_text(encoding="utf-8")
    assert "class VNREG_API Registrar" in (site / "reference_cpp.html").read_text(encoding="utf-8")


def test_the_site_asks_nothing_of_the_network(site: Path) -> None:
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.search(r'(?:src|<link[^>]*href)="(?:https?:)?//', text), page
