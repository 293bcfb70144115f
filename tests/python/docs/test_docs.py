"""The site builds from this repository alone, and every code block in the docs runs."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray

import vnreg

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "docs"))
from site_hooks import run_doxygen

ROOT = Path(__file__).resolve().parents[3]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "HACKING.md", *sorted(DOCS.glob("*.md"))]
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


BLOCKS = [block for path in PAGES for block in blocks_of(path)]

# The README shows what matters of a program. This is what it leaves out.
LEFT_OUT = {
    "python": """
import numpy as np
source, target = np.loadtxt("mug_1.xyz"), np.loadtxt("mug_2.xyz")
""",
    "cpp": """
#include <array>
#include <fstream>
#include <vector>
std::vector<std::array<float, 3>> read(const char* path) {
  std::vector<std::array<float, 3>> points;
  std::ifstream file(path);
  for (std::array<float, 3> p; file >> p[0] >> p[1] >> p[2];) points.push_back(p);
  return points;
}
""",
}


def whole_program(block: Block) -> str:
    """The block, or, of the README, the block with what it leaves out."""
    if block.page != "README.md":
        return block.text
    if block.language == "python":
        return LEFT_OUT["python"] + block.text
    includes, body = block.text.split("\n", 1)
    return (
        f"{includes}\n{LEFT_OUT['cpp']}\nint main() {{\n"
        'const auto source = read("mug_1.xyz"), target = read("mug_2.xyz");\nint uses = 0;\n'
        "const auto use = [&](const vnreg::Pose&) { ++uses; };\n"
        f"{body}return uses == 1 ? 0 : 1;\n}}\n"
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the files that the blocks name."""
    for name in ("mug_1.xyz", "mug_2.xyz"):
        shutil.copy(ROOT / "examples/data" / name, tmp_path)
    shutil.copytree(ROOT / "models", tmp_path / "models")
    for name in ("libvnreg.so", "libvnreg.so.0.1"):
        (tmp_path / name).symlink_to(library_folder() / name)
    points = (tmp_path / "mug_1.xyz").read_text(encoding="utf-8")
    head = f"{points.count(chr(10))}\nproperty float x\nproperty float y\nproperty float z\n"
    (tmp_path / "scans").mkdir()
    scans = ("scan.ply", "scan_1.ply", "scan_2.ply", "scans/1.ply", "source.ply", "target.ply")
    for name in scans:
        (tmp_path / name).write_text(
            f"ply\nformat ascii 1.0\nelement vertex {head}end_header\n{points}", encoding="utf-8"
        )
    (tmp_path / "pairs.csv").write_text("source,target\nmug_1.xyz,mug_2.xyz\n", encoding="utf-8")
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
    (folder / "block.py").write_text(whole_program(block), encoding="utf-8")
    run(folder, sys.executable, "block.py")


def run_compiled(block: Block, folder: Path) -> None:
    source = folder / f"block.{block.language}"
    source.write_text(whole_program(block), encoding="utf-8")
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


def program_path() -> Path:
    program = Path(os.environ.get("VNREG_CLI", ROOT / "build/release/vnreg"))
    assert program.is_file(), f"no program at {program}: build it, or set VNREG_CLI"
    return program


def run_shell(block: Block, folder: Path) -> None:
    """Commands of the program run. Of `make` and `cmake` it is seen that they know what to do."""
    for line in block.text.splitlines():
        name, *arguments = shlex.split(line, comments=True)
        if Path(name).name == "vnreg":
            # By a shell, for its redirections. 4: a pose, but not a sure one
            call = shlex.join([str(program_path()), *arguments])
            for redirection in "<>":
                call = call.replace(f"'{redirection}'", redirection)
            run(folder, "bash", "-c", call, ok=(0, 4))
        elif name == "make":
            run(ROOT, "make", "-n", *arguments)
        else:
            assert [name, arguments[0]] == ["cmake", "--preset"], line
            assert f'"{arguments[1]}"' in run(ROOT, "cmake", "--list-presets")


def numbers(text: str) -> NDArray[np.float64]:
    """The 4 x 4 matrix behind `T_target_source`."""
    rows = text.split("T_target_source\n")[1].splitlines()[:4]
    return np.array([row.split() for row in rows], dtype=np.float64)


def compare_output(block: Block, folder: Path) -> None:
    """Text is a list of commands, or what a command prints."""
    if block.page == "README.md":
        compare_with_the_demo(block, folder)
    elif block.text.startswith("$ "):
        command, shown = block.text.split("\n", 1)
        arguments = command.removeprefix("$ vnreg ").split()
        printed = run(folder, program_path(), *arguments, ok=(0, 4))
        words = [line.split()[0] for line in shown.splitlines() if line[0] != " "]
        assert words == [line.split()[0] for line in printed.splitlines() if line[0] != " "]
        np.testing.assert_allclose(numbers(printed), numbers(shown), atol=0.02)
    else:
        for line in block.text.splitlines():
            command = re.split(r" {2,}", line)[0]
            word = command.split()[1]
            run(folder, program_path(), *([word] if word[0] == "-" else [word, "--help"]))


def compare_with_the_demo(block: Block, folder: Path) -> None:
    if not any((ROOT / "data/scans").glob("*")):
        pytest.skip("the scans of `make demo` have not been fetched")
    program = ["--program", str(program_path()), "--out", str(folder), "--check"]
    printed = run(ROOT, sys.executable, ROOT / "examples/demo/demo.py", *program)
    np.testing.assert_allclose(numbers(printed), numbers(block.text), atol=0.02)
    angles = [re.findall(r"rotation error ([\d.]+)", text)[0] for text in (printed, block.text)]
    assert float(angles[0]) == pytest.approx(float(angles[1]), abs=0.5)


RUN: dict[str, Callable[[Block, Path], None]] = {
    "python": run_python,
    "cpp": run_compiled,
    "c": run_compiled,
    "cmake": run_cmake,
    "sh": run_shell,
    "text": compare_output,
}


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: f"{block.page}:{block.line}")
def test_a_code_block_runs(block: Block, folder: Path) -> None:
    assert block.language in RUN, f"{block.page}:{block.line}: {block.language or 'no language'}"
    RUN[block.language](block, folder)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_code_hides_from_the_test(page: Path) -> None:
    """In a fence of another kind, or an indented one."""
    text = page.read_text(encoding="utf-8")
    fences = re.findall(r"^\s*(?:```|~~~)", text, re.M)
    assert len(fences) == 2 * len(blocks_of(page))


def test_there_are_blocks_of_every_kind() -> None:
    assert {block.language for block in BLOCKS} >= set(RUN)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs", reason="requirements/dev.txt is not installed")
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


def test_the_reference_says_what_to_include(site: Path) -> None:
    page = (site / "api/classvnreg_1_1Registrar.html").read_text(encoding="utf-8")
    assert "vnreg/vnreg.hpp" in page.split("#include")[1].split("</code>")[0]


def names_in_the_headers_reference(site: Path) -> set[str]:
    """Qualified names, of classes and of the members of everything."""
    names = set()
    for compound in ElementTree.parse(site / "api/vnreg.tag").iter("compound"):
        scope = compound.findtext("name", "")
        prefix = f"{scope}::" if compound.get("kind") in ("class", "struct", "namespace") else ""
        names.add(scope)
        names |= {prefix + member.findtext("name", "") for member in compound.iter("member")}
        names |= {prefix + value.text for value in compound.iter("enumvalue") if value.text}
    return names


def test_the_reference_has_every_symbol_of_the_library(site: Path) -> None:
    documented = names_in_the_headers_reference(site)
    library = library_folder() / "libvnreg.so"
    listed = subprocess.run(
        ["nm", "-D", "-C", "--defined-only", library], capture_output=True, text=True, check=True
    ).stdout
    symbols = {line.split(" ", 2)[2].split("(")[0].split("@")[0] for line in listed.splitlines()}
    of_the_compiler = {name for name in symbols if re.match(r"vtable|typeinfo|.*::~", name)}
    symbols -= of_the_compiler | {"VNREG"}
    assert len(symbols) > 50
    assert symbols - documented == set()


def test_the_reference_has_every_name_of_the_c_header(site: Path) -> None:
    header = (ROOT / "engine/include/vnreg/vnreg.h").read_text(encoding="utf-8")
    code = re.sub(r"/\*[\s\S]*?\*/", "", header)
    names = set(re.findall(r"\b(?:vnreg|VNREG)_\w+", code)) - {"VNREG_VNREG_H"}
    assert len(names) > 70
    assert names - names_in_the_headers_reference(site) == set()


def test_what_is_not_documented_fails_the_site(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "engine/include/vnreg", tmp_path / "vnreg")
    header = tmp_path / "vnreg/cancellation.hpp"
    text = header.read_text(encoding="utf-8")
    header.write_text(text.replace("  /// Lets calls run again.\n", ""), encoding="utf-8")
    with pytest.raises(RuntimeError, match=r"Member reset\(\).* is not documented"):
        run_doxygen(tmp_path / "out", headers=tmp_path)


LINK = re.compile(r'(?:href|src)="([^"#]*)(?:#([^"]*))?"')


def test_no_link_of_the_site_is_dead(site: Path) -> None:
    pages = {path: path.read_text(encoding="utf-8") for path in site.rglob("*.html")}
    dead = set()
    for page, text in pages.items():
        for target, anchor in LINK.findall(text):
            if re.match(r"[a-z]+:|//", target) or page.name == "404.html":
                continue
            path = (page.parent / unquote(target)).resolve() if target else page
            path = path / "index.html" if path.is_dir() else path
            known = path.is_file() and (
                not anchor or path not in pages or f'="{unquote(anchor)}"' in pages[path]
            )
            if not known:
                dead.add(f"{page.relative_to(site)}: {target}#{anchor}")
    assert len(pages) > 40
    assert dead == set()


@pytest.mark.parametrize(
    "page",
    [*PAGES, *ROOT.glob("models/*.md"), ROOT / "model_format/SPEC.md", ROOT / "data/README.md"],
    ids=lambda page: page.name,
)
def test_no_link_in_the_repository_is_dead(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s#]+)[^)]*\)", page.read_text(encoding="utf-8")):
        if not re.match(r"https?:", target) and not target.startswith("api/"):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_site_asks_nothing_of_the_network(site: Path) -> None:
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.search(r'(?:src|<link[^>]*href)="(?:https?:)?//', text), page
