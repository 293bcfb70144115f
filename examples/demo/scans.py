"""Fetches the demo's pair: two real range scans of one figurine (see data/README.md)."""

from __future__ import annotations

import subprocess
import tarfile
import tempfile
from pathlib import Path

import numpy as np

PACKAGE = "libcgal-demo"
ARCHIVE = "usr/share/doc/libcgal-dev/data.tar.gz"
NAMES = ("hippo1.ply", "hippo2.ply")

# Found once by an exhaustive search (oriented point pairs, then point-to-plane ICP in both
# directions); good to about 0.1 degree. Only `--check` uses it.
T_TRUE = np.array(
    [
        [0.73302821, -0.04643103, 0.67861167, 0.10222426],
        [0.01407945, 0.99848947, 0.05310880, 0.00800167],
        [-0.68005251, -0.02937577, 0.73257467, -0.04396647],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


def fetch(folder: Path) -> tuple[Path, Path]:
    """The paths of source and target below `folder`, fetched from the Debian archive if absent.

    The package is downloaded and unpacked, never installed. RuntimeError says what went wrong.
    """
    paths = (folder / NAMES[0], folder / NAMES[1])
    if not all(path.exists() for path in paths):
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as scratch:
            _unpack(Path(scratch), folder)
    return paths


def _unpack(scratch: Path, folder: Path) -> None:
    _run(["apt-get", "download", PACKAGE], scratch)
    (package,) = scratch.glob(f"{PACKAGE}_*.deb")
    _run(["dpkg-deb", "-x", str(package), "."], scratch)
    with tarfile.open(scratch / ARCHIVE) as archive:
        for name in NAMES:
            member = archive.extractfile(f"data/points_3/{name}")
            if member is None:
                raise RuntimeError(f"{ARCHIVE}: expected data/points_3/{name}")
            (folder / name).write_bytes(member.read())


def _run(command: list[str], folder: Path) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip() or done.stdout.strip()}")
