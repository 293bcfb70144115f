"""Models and their errors, and the module itself."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import vnreg

ROOT = Path(__file__).resolve().parents[3]


def test_a_model_tells_what_it_is(model: vnreg.Model) -> None:
    assert model.name == "arbitrary"
    assert model.points == 512
    assert model.min_points == 24
    assert repr(model) == "vnreg.Model(name='arbitrary', points=512)"


def test_bytes_and_any_path_give_the_same_model(model_path: Path, tmp_path: Path) -> None:
    odd = tmp_path / "módèle \udcff.vnr"  # a name that is not UTF-8
    odd.write_bytes(model_path.read_bytes())
    for path in (odd, str(odd), os.fsencode(odd)):
        assert vnreg.Model.load(path).name == "arbitrary"
    assert vnreg.Model.from_bytes(model_path.read_bytes()).name == "arbitrary"


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(vnreg.Error, match=re.escape(str(tmp_path / "none.vnr"))) as caught:
        vnreg.Model.load(tmp_path / "none.vnr")
    error = caught.value
    assert isinstance(error, RuntimeError)
    assert error.code == "file_unreadable"
    assert str(error) == f"{error.field}: expected {error.expected}, got {error.got}"


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"", "not_a_model"),
        (b"ply\nformat ascii 1.0\n", "not_a_model"),
    ],
)
def test_what_is_no_model_is_refused(content: bytes, code: str, tmp_path: Path) -> None:
    path = tmp_path / "x.vnr"
    path.write_bytes(content)
    for load in (lambda: vnreg.Model.from_bytes(content), lambda: vnreg.Model.load(path)):
        with pytest.raises(vnreg.Error) as caught:
            load()
        assert caught.value.code == code


@pytest.mark.parametrize("position", [8, 20, 70, 300, -1])
def test_a_damaged_model_is_refused(position: int, model_path: Path) -> None:
    content = bytearray(model_path.read_bytes())
    content[position] ^= 0x10
    with pytest.raises(vnreg.Error) as caught:
        vnreg.Model.from_bytes(bytes(content))
    assert caught.value.code in ("corrupt_model", "unsupported_version")


@pytest.mark.parametrize("path", [None, 3.5, ["x"]])
def test_what_is_no_path_is_a_type_error(path: object) -> None:
    with pytest.raises(TypeError):
        vnreg.Model.load(path)  # type: ignore[arg-type]  # refused is what is tested


def test_versions_agree() -> None:
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    cmake = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    assert f'\nversion = "{vnreg.__version__}"\n' in project
    assert f"project(vnreg VERSION {vnreg.__version__} " in cmake


def test_the_instruction_set_is_one_of_the_builds() -> None:
    assert vnreg.instruction_set() in ("x86-64-v2", "x86-64-v3", "x86-64-v4", "native")


def test_everything_public_is_documented() -> None:
    assert vnreg.__doc__
    for name in vnreg.__all__:
        thing = getattr(vnreg, name)
        if name == "__version__":
            continue
        assert thing.__doc__, name
        for member in vars(thing) if isinstance(thing, type) else ():
            if not member.startswith("_"):
                assert getattr(thing, member).__doc__, f"{name}.{member}"


def run(*command: str, cwd: Path) -> None:
    package = str(Path(vnreg.__file__).parent.parent)
    environment = os.environ | {"MYPYPATH": "", "PYTHONPATH": package}
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=cwd, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


def stub_members() -> dict[str, ast.stmt]:
    """Everything that the stub declares: {"align": ..., "Model.load": ...}; properties too."""
    stub = Path(vnreg.__file__).with_name("_vnreg.pyi").read_text(encoding="utf-8")
    members: dict[str, ast.stmt] = {}
    for node in ast.parse(stub).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            members[node.name] = node
        if isinstance(node, ast.ClassDef) and node.name != "Error":
            members |= {
                f"{node.name}.{item.name}": item
                for item in node.body
                if isinstance(item, ast.FunctionDef)
            }
    return members


def runtime_members() -> set[str]:
    names = set()
    for name, thing in vars(vnreg._vnreg).items():
        if name.startswith("__") or not callable(thing):
            continue
        names.add(name)
        if isinstance(thing, type) and thing is not vnreg.Error:
            names |= {f"{name}.{member}" for member in vars(thing) if not member.startswith("_")}
    return names


def test_the_stub_names_what_the_module_has() -> None:
    declared = {name for name in stub_members() if not name.endswith("__")}
    assert declared == runtime_members()


@pytest.mark.parametrize(
    "name",
    [
        "align",
        "align_many",
        "instruction_set",
        "Model.load",
        "Model.from_bytes",
        "Model.builtin",
        "Registrar.__init__",
        "Registrar.align",
        "Registrar.prepare",
        "Registrar.stages",
    ],
)
def test_the_stub_has_the_arguments_and_defaults_of_the_module(name: str) -> None:
    thing: Any = vnreg
    for part in name.split("."):
        thing = getattr(thing, part)
    signature, _, defaults = thing.__nb_signature__[0]
    declared = stub_members()[name]
    assert isinstance(declared, ast.FunctionDef)
    # nanobind writes a default as \0, \1, ...: an index into the tuple of defaults.
    text = re.sub(r"\\(\d+)", lambda m: repr(defaults[int(m[1])]), signature)
    actual = ast.parse(f"{text}: ...").body[0]
    assert isinstance(actual, ast.FunctionDef)
    for kind in ("args", "kwonlyargs"):
        assert [a.arg for a in getattr(declared.args, kind)] == [
            a.arg for a in getattr(actual.args, kind)
        ]
    for kind in ("defaults", "kw_defaults"):
        assert [ast.dump(d) for d in getattr(declared.args, kind)] == [
            ast.dump(d) for d in getattr(actual.args, kind)
        ]


def test_typed_use_passes_strict_checking(tmp_path: Path) -> None:
    (tmp_path / "use.py").write_text(
        "import numpy as np\n"
        "import vnreg\n"
        "def pose(path: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:\n"
        "    registrar = vnreg.Registrar(vnreg.Model.load(path), mode='coarse', threads=2)\n"
        "    result = registrar.align(np.zeros((9, 3)), [[0.0, 1.0, 2.0]])\n"
        "    assert result.status != 'degenerate' and result.ms['total'] > 0\n"
        "    prepared = registrar.prepare(np.zeros((9, 3)))\n"
        "    many = vnreg.align_many([(prepared, np.zeros((9, 3)))], time_budget_ms=5)\n"
        "    assert len(many) + len(prepared) and registrar.align(prepared, prepared)\n"
        "    return result.T_target_source\n",
        encoding="utf-8",
    )
    run("mypy", "--strict", "use.py", cwd=tmp_path)


def test_importing_needs_numpy_only() -> None:
    script = (
        "import sys, vnreg\n"
        "loaded = {name.split('.')[0] for name in sys.modules} - set(sys.stdlib_module_names)\n"
        "allowed = {'vnreg', 'numpy', '__main__', 'sitecustomize', 'usercustomize'}\n"
        "extra = {n for n in loaded - allowed if not n.startswith(('_', 'numpy'))}\n"
        "assert not extra, extra\n"
    )
    package = str(Path(vnreg.__file__).parent.parent)
    environment = os.environ | {"PYTHONPATH": package}
    subprocess.run([sys.executable, "-c", script], check=True, env=environment)
