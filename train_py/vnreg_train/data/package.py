"""The Debian package of furniture models: fetched into a cache folder and unpacked there.

Nothing is installed and no root rights are needed (except to fetch apt's lists where there are
none at all).
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

from vnreg_train.data.catalog import ARCHIVES

PACKAGE = "sweethome3d-furniture"
KNOWN_VERSION = "1.8-1"
ARCHIVE_FOLDER = Path("usr/share/sweethome3d/furniture")
APT_LISTS = Path("/var/lib/apt/lists")


class PackageError(RuntimeError):
    """The furniture package could not be fetched or unpacked; says what to do."""


def _run(command: Sequence[str], folder: Path) -> None:
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise PackageError(f"{command[0]} is not on this system ({_by_hand(folder)})") from error
    if done.returncode != 0:
        last = " ".join(done.stderr.split())[-300:]
        raise PackageError(f"{' '.join(command)} failed: {last} ({_by_hand(folder)})")


def _by_hand(folder: Path) -> str:
    return f"by hand: put {PACKAGE}_{KNOWN_VERSION}_all.deb from a Debian mirror into {folder}"


def _has_apt_lists() -> bool:
    return any(APT_LISTS.glob("*_Packages*"))


def _downloaded(cache: Path) -> Path:
    """The .deb in the cache folder, downloaded by apt-get where there is none yet."""
    found = sorted(cache.glob(f"{PACKAGE}_*_all.deb"))
    if not found:
        if not _has_apt_lists():
            _run(["apt-get", "update"], cache)
        _run(["apt-get", "download", PACKAGE], cache)
        found = sorted(cache.glob(f"{PACKAGE}_*_all.deb"))
    if not found:
        raise PackageError(f"apt-get downloaded no {PACKAGE} ({_by_hand(cache)})")
    known = [path for path in found if f"_{KNOWN_VERSION}_" in path.name]
    return (known or found)[-1]


def fetch_archives(cache: Path) -> tuple[Path, str]:
    """Folder of the five .sh3f archives under `cache`, and the version of their package.

    Downloads and unpacks what is not in the cache yet. Raises PackageError.
    """
    cache.mkdir(parents=True, exist_ok=True)
    package = _downloaded(cache)
    match = re.fullmatch(rf"{re.escape(PACKAGE)}_(.+)_all\.deb", package.name)
    version = match[1].replace("%3a", ":") if match else "unknown"
    unpacked = cache / package.stem
    folder = unpacked / ARCHIVE_FOLDER
    if not all((folder / f"{name}.sh3f").is_file() for name in ARCHIVES):
        _run(["dpkg-deb", "-x", str(package.resolve()), str(unpacked.resolve())], cache)
    missing = [name for name in ARCHIVES if not (folder / f"{name}.sh3f").is_file()]
    if missing:
        raise PackageError(f"{package}: archives {missing} are not in the package")
    return folder, version
