"""What `vnreg-train COMMAND --help` teaches: what goes in, what comes out, how long, an example."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from textwrap import fill, indent
from typing import Any

Subcommands = Any  # argparse names the type privately
WIDTH = 100
LABEL = 8


@dataclass(frozen=True)
class Lesson:
    """The text above and below a command's options. example: words after `vnreg-train`."""

    summary: str
    reads: str
    writes: str
    takes: str
    example: str

    def description(self) -> str:
        """The summary as a sentence, then a paragraph for each of the other three."""
        parts = [fill(self.summary[0].upper() + self.summary[1:] + ".", WIDTH), ""]
        for label in ("reads", "writes", "takes"):
            text = fill(getattr(self, label), WIDTH - LABEL)
            parts.append(f"{label:<{LABEL}}" + indent(text, " " * LABEL).lstrip())
        return "\n".join(parts)


class _Formatter(argparse.ArgumentDefaultsHelpFormatter, argparse.RawDescriptionHelpFormatter):
    """Keeps the lines of the description; tells the defaults that say something."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=26, width=WIDTH)

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default = action.default
        if default is None or default is False or default == [] or default == float("inf"):
            return action.help
        if isinstance(default, list):
            return f"{action.help} (default: {' '.join(map(str, default))})"
        return super()._get_help_string(action)


def add_command(commands: Subcommands, name: str, lesson: Lesson) -> argparse.ArgumentParser:
    """A command without options yet."""
    command: argparse.ArgumentParser = commands.add_parser(
        name,
        help=lesson.summary,
        description=lesson.description(),
        epilog=f"example:\n  vnreg-train {lesson.example}",
        formatter_class=_Formatter,
    )
    return command
