"""Runs the program as at a terminal: both outputs are one pseudo-terminal."""

from __future__ import annotations

import fcntl
import os
import pty
import struct
import subprocess
import termios
from pathlib import Path


def at_terminal(
    *command: str | Path, environment: dict[str, str] | None = None, columns: int = 100
) -> tuple[int, str]:
    """The exit code, and everything that was drawn."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    inherited = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "TERM")}
    process = subprocess.Popen(
        [str(part) for part in command],
        stdout=theirs,
        stderr=theirs,
        env=inherited | {"TERM": "xterm"} | (environment or {}),
    )
    os.close(theirs)
    drawn = b""
    try:
        while piece := os.read(ours, 65536):
            drawn += piece
    except OSError:  # Linux reports the end of the other side so
        pass
    os.close(ours)
    return process.wait(timeout=60), drawn.decode()
