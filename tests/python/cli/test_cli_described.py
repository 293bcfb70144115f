"""The program describes itself: manual page and completions, made of its own options."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from cli_program import OK, USAGE, Program, repository

COMMANDS = ["align", "batch", "bench", "info", "selftest", "completion", "manual"]


def text_of(vnreg: Program, *arguments: str) -> str:
    run = vnreg(*arguments)
    assert (run.code, run.stderr) == (OK, "")
    return run.stdout


def options_in_help(vnreg: Program, *command: str) -> set[str]:
    """The names of the options that `--help` lists."""
    listed = text_of(vnreg, *command, "--help").partition("Options:")[2]
    heads = re.findall(r"^  (-\S+)", listed, re.MULTILINE)
    names = {name for head in heads for name in head.split(",")}
    assert {"-h", "--help"} <= names
    return names


def subcommands_in_help(vnreg: Program) -> list[str]:
    listed = text_of(vnreg, "--help").partition("Subcommands:\n")[2]
    return re.findall(r"^  (\w+)", listed, re.MULTILINE)


def test_there_are_no_other_commands(vnreg: Program) -> None:
    assert subcommands_in_help(vnreg) == COMMANDS


# ---- bash ----


def complete(script: str, *words: str) -> list[str]:
    """What bash offers for the last of these words of a command line."""
    line = " ".join(f"'{word}'" for word in words)
    program = f"""{script}
COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}
compopt() {{ echo "compopt $*"; }}
_vnreg
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    command = ["bash", "--norc", "-c", program]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


@pytest.fixture(scope="module")
def bash(vnreg: Program) -> str:
    return text_of(vnreg, "completion", "bash")


def test_bash_completes_the_commands(bash: str, vnreg: Program) -> None:
    assert complete(bash, "vnreg", "b") == ["batch", "bench"]
    assert set(complete(bash, "vnreg", "")) == {*COMMANDS, *options_in_help(vnreg)}


@pytest.mark.parametrize("command", COMMANDS)
def test_bash_completes_every_option(bash: str, vnreg: Program, command: str) -> None:
    offered = complete(bash, "vnreg", command, "-")
    assert set(offered) == options_in_help(vnreg, command)
    assert complete(bash, "vnreg", command, "--help") == ["--help"]


def test_bash_completes_values(bash: str) -> None:
    assert complete(bash, "vnreg", "align", "--mode", "") == ["coarse", "paper", "verified"]
    assert complete(bash, "vnreg", "batch", "a", "--mode", "v") == ["verified"]
    assert complete(bash, "vnreg", "completion", "z") == ["zsh"]
    # Nothing of its own: bash completes names of files, but not where a number belongs.
    assert complete(bash, "vnreg", "align", "") == []
    assert complete(bash, "vnreg", "align", "--model", "") == []
    assert complete(bash, "vnreg", "align", "--threads", "") == ["compopt", "+o", "default"]


# ---- zsh ----


def zsh_calls(script: str, *words: str) -> list[str]:
    """What the function gives zsh's own _arguments and _describe, one argument a line."""
    line = " ".join(f"'{word}'" for word in words)
    program = f"""compdef() {{ }}
_arguments() {{ print -rl -- $words[1] "$@" }}
_describe() {{ print -rl -- ${{(P)@[-1]}} }}
{script}
words=({line}); CURRENT={len(words)}
_vnreg
"""
    command = ["zsh", "-f", "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def zsh(vnreg: Program) -> str:
    assert shutil.which("zsh"), "zsh is needed: make debian-packages"
    return text_of(vnreg, "completion", "zsh")


def test_zsh_completes_the_commands(zsh: str) -> None:
    assert zsh.startswith("#compdef vnreg\n")
    assert [line.partition(":")[0] for line in zsh_calls(zsh, "vnreg", "")] == COMMANDS


@pytest.mark.parametrize("command", COMMANDS)
def test_zsh_completes_every_option(zsh: str, vnreg: Program, command: str) -> None:
    first, dash_s, *specs = zsh_calls(zsh, "vnreg", command, "")
    assert (first, dash_s) == (command, "-S")
    names = {name for spec in specs for name in re.findall(r"^(?:\(.*\))?(-[\w-]+)(?=\[)", spec)}
    assert names == options_in_help(vnreg, command)
    if command == "align":
        assert any(spec.endswith(":MODE:(coarse paper verified)") for spec in specs)
        assert any(spec.startswith("--model[") and spec.endswith(":FILE:_files") for spec in specs)
        assert any(spec.startswith("*:FILE:_files") for spec in specs)


def test_other_shells_are_refused(vnreg: Program) -> None:
    assert "SHELL" in vnreg("completion", "fish").error(USAGE)


# ---- the manual page ----


@pytest.fixture(scope="module")
def manual(vnreg: Program) -> str:
    """The page as roff prints it, without bold and underlines; roff must have no complaint."""
    page = text_of(vnreg, "manual")
    command = ["groff", "-man", "-ww", "-Tascii", "-P-cbou"]
    done = subprocess.run(command, input=page, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_the_manual_has_every_option(manual: str, vnreg: Program, command: str) -> None:
    section = manual.partition(f"\n   vnreg {command}\n")[2].partition("\n   vnreg ")[0]
    heads = re.findall(r"^       (-\S.*?)(?: {2,}.*)?$", section, re.MULTILINE)
    found = {name for head in heads for name in re.findall(r"(?:^|, )(--?[\w-]+)", head)}
    assert found == options_in_help(vnreg, command)
    assert f"vnreg {command} [OPTIONS]" in manual.partition("SYNOPSIS")[2]


def test_the_manual_and_the_documentation_have_the_same_exit_codes(manual: str) -> None:
    section = manual.partition("EXIT STATUS")[2].partition("ENVIRONMENT")[0]
    of_manual = re.findall(r"^       (\d+) ", section, re.MULTILINE)
    table = (repository / "docs" / "cli.md").read_text().partition("| exit code |")[2]
    of_documentation = re.findall(r"^\| (\d+) \|", table.partition("\n\n")[0], re.MULTILINE)
    assert of_manual == of_documentation == ["0", "1", "2", "3", "4", "130"]
    assert "NO_COLOR" in manual


def test_the_documentation_has_every_command_and_option(vnreg: Program) -> None:
    page = (repository / "docs" / "cli.md").read_text()
    for command in COMMANDS:
        heading = re.search(rf"\n## .*\bvnreg {command}\b", page)
        assert heading, command
        section = page[heading.end() :].partition("\n## ")[0]
        shared = page.partition("\n## Options of align and batch\n")[2].partition("\n## ")[0]
        if command in ("align", "batch"):
            section += shared
        for name in options_in_help(vnreg, command) - {"-h", "--help"}:
            assert re.search(rf"(?<![\w-]){name}(?![\w-])", section), f"{command} {name}"


def test_installed_pages_are_the_program_s_own(vnreg: Program, program_path: Path) -> None:
    """What the build made beside the program, and the package installs."""
    described = program_path.parent / "cli" / "described"
    if not described.is_dir():
        pytest.skip("not a build tree of CMake")
    assert (described / "vnreg.1").read_text() == text_of(vnreg, "manual")
    assert (described / "vnreg").read_text() == text_of(vnreg, "completion", "bash")
    assert (described / "_vnreg").read_text() == text_of(vnreg, "completion", "zsh")
