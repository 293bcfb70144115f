"""`vnreg-train COMMAND --help` teaches: the example parses, every option is described."""

from __future__ import annotations

import argparse
import re
import shlex
import subprocess
import sys

import pytest

from vnreg_train.cli import parser


def commands() -> dict[str, argparse.ArgumentParser]:
    """Every command by its name."""
    found = [a for a in parser()._actions if isinstance(a, argparse._SubParsersAction)]
    return dict(found[0].choices)


COMMANDS = commands()


def test_the_commands_of_the_way_to_a_model_are_there() -> None:
    assert {"build-data", "train", "evaluate", "export", "inspect", "gallery"} <= set(COMMANDS)
    root = parser().format_help()
    assert all(f"    {name}" in root for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_example_parses(name: str) -> None:
    text = COMMANDS[name].format_help()
    example = re.search(r"^example:\n  vnreg-train (.+)$", text, re.M)
    assert example, text
    words = shlex.split(example[1])
    assert words[0] == name
    assert callable(parser().parse_args(words).run_command)


@pytest.mark.parametrize("name", COMMANDS)
def test_what_goes_in_what_comes_out_and_how_long(name: str) -> None:
    description = COMMANDS[name].description or ""
    labels = [line.split()[0] for line in description.splitlines() if re.match(r"\w+ {2,}", line)]
    assert labels == ["reads", "writes", "takes"]
    assert all(len(line) <= 100 for line in COMMANDS[name].format_help().splitlines())


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_described_with_its_default(name: str) -> None:
    command = COMMANDS[name]
    text = " ".join(command.format_help().split())
    for action in command._actions:
        assert action.help, f"{name}: {action.option_strings or action.dest} is not described"
        if isinstance(action.default, str | int) and not isinstance(action.default, bool):
            if action.default is not argparse.SUPPRESS:
                assert f"(default: {action.default})" in text


def test_help_loads_nothing_heavy() -> None:
    program = "import sys; from vnreg_train.cli import parser; parser(); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not {"torch", "h5py", "scipy", "matplotlib", "vnreg"} & set(done.stdout.split())
