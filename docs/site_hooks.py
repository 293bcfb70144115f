"""What MkDocs cannot do by itself: pages that are made of files elsewhere in the repository.

A line `{{ file PATH }}` becomes the content of a Markdown file, `{{ module vnreg }}` the
documentation of the Python module. The folder `api` of the site is what Doxygen makes of the
public headers.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import subprocess
from pathlib import Path
from types import ModuleType
from typing import Any

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[1]
OUTSIDE = re.compile(r"\]\((?:\.\./)+([^)#]*)(#[^)]*)?\)")


def on_config(config: Any) -> Any:
    """Called by MkDocs with its configuration: pages that it does not list go to the end."""
    listed = set(re.findall(r"\w+\.md", str(config.nav)))
    for path in sorted(Path(config.docs_dir).glob("*.md")):
        if path.name not in listed:
            config.nav.append({path.stem.replace("_", " ").capitalize(): path.name})
    return config


def on_files(files: Any, config: Any) -> Any:
    """Called by MkDocs with the site's files: adds the reference of the headers."""
    folder = ROOT / "build/doxygen"
    run_doxygen(folder)
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            name = f"api/{path.relative_to(folder).as_posix()}"
            files.append(File.generated(config, name, abs_src_path=str(path)))
    return files


def run_doxygen(folder: Path, headers: Path = ROOT / "engine/include") -> None:
    """Writes the reference of the public headers and its list of names, `vnreg.tag`, to `folder`.

    Fails where a header has something that is not documented.
    """
    folder.mkdir(parents=True, exist_ok=True)
    settings = (ROOT / "docs/doxygen/Doxyfile").read_text(encoding="utf-8")
    settings += f"OUTPUT_DIRECTORY = {folder}\nGENERATE_TAGFILE = {folder / 'vnreg.tag'}\n"
    settings += f"INPUT = {headers / 'vnreg'} docs/doxygen/main.md\n"
    settings += f"STRIP_FROM_PATH = {headers}\nSTRIP_FROM_INC_PATH = {headers}\n"
    done = subprocess.run(
        ["doxygen", "-"], cwd=ROOT, input=settings, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"doxygen: {done.stderr}")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Called by MkDocs with the text of every page."""
    text = re.sub(r"^\{\{ (\w+) (.+?) \}\}$", _replacement, markdown, flags=re.M)
    # What lies outside of docs/ is not on the site: named, not linked.
    return OUTSIDE.sub("] (`\\1`)", text).replace("[] (", "(")


def _replacement(match: re.Match[str]) -> str:
    kind, argument = match[1], match[2]
    if kind == "file":
        return (ROOT / argument).read_text(encoding="utf-8")
    if kind == "module":
        return module_reference(importlib.import_module(argument))
    raise ValueError(f"unknown instruction: {match[0]}")


def module_reference(module: ModuleType) -> str:
    """Every public name of the module, its signature and its docstring."""
    stub = Path(str(module.__file__)).with_name("_vnreg.pyi")
    parts = [inspect.getdoc(module) or ""]
    for name in module.__all__:
        thing = getattr(module, name)
        if name == "__version__":
            continue
        signatures = _signatures(_source_file(thing, stub))
        parts += [f"## {name}", _signature(signatures, name), _text(thing)]
        for member in vars(thing) if isinstance(thing, type) else ():
            key = f"{name}.{member}"
            if not member.startswith("_") and key in signatures:
                parts += [f"### {key}", _signature(signatures, key), _text(getattr(thing, member))]
    return "\n\n".join(part for part in parts if part)


def _text(thing: Any) -> str:
    """A docstring without the signatures that nanobind puts in front, as preformatted text."""
    doc = inspect.getdoc(thing) or ""
    doc = re.sub(r"\A(?:\w+\(.*\n+)+", "", doc)
    return f"<pre>{_escaped(doc)}</pre>" if doc else ""


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _source_file(thing: Any, stub: Path) -> Path:
    """Where a thing of Python is written; of what is compiled, the type stub."""
    try:
        written = inspect.getsourcefile(thing)
    except TypeError:  # no class or function
        return stub
    return Path(written) if written else stub


def _signature(signatures: dict[str, str], key: str) -> str:
    text = signatures.get(f"{key}.__init__", signatures.get(key, ""))
    return f"```python\n{text}\n```" if text else ""


def _signatures(path: Path) -> dict[str, str]:
    """{"align": "def align(...) -> Result", "Model.load": ...} of a type stub or a module."""

    signatures: dict[str, str] = {}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        members = node.body if isinstance(node, ast.ClassDef) else [node]
        prefix = f"{node.name}." if isinstance(node, ast.ClassDef) else ""
        for member in members:
            if isinstance(member, ast.FunctionDef):
                member.body = []
                signatures[prefix + member.name] = ast.unparse(member).removesuffix(":")
    return signatures
