"""Sweet Home 3D furniture archives (.sh3f): what models they hold, by whom, on what terms."""

from __future__ import annotations

import hashlib
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

CATALOG = "PluginFurnitureCatalog.properties"
ARCHIVES = ("BlendSwap-CC-0", "BlendSwap-CC-BY", "KatorLegaz", "Reallusion", "Scopia")
ESCAPES = {"t": "\t", "n": "\n", "r": "\r", "f": "\f"}


class CatalogError(ValueError):
    """An archive whose catalog cannot be read or lacks a needed field."""


@dataclass(frozen=True)
class Model:
    """One model of a catalog. `path` (of the OBJ inside the archive) is its identity."""

    path: str
    name: str
    category: str
    creator: str
    licence: str
    archive: str


def parse_properties(text: str) -> dict[str, str]:
    """Java .properties text as a dictionary (comments, continuations, escapes)."""
    lines = re.sub(r"(?<!\\)((?:\\\\)*)\\\r?\n[ \t\f]*", r"\1", text).splitlines()
    entries: dict[str, str] = {}
    for line in (line.lstrip(" \t\f") for line in lines):
        if line and line[0] not in "#!":
            match = re.match(r"((?:\\.|[^\\=: \t\f])*)[ \t\f]*[=:]?[ \t\f]*(.*)", line, re.DOTALL)
            if match:
                entries[_unescaped(match[1])] = _unescaped(match[2])
    return entries


def _unescaped(text: str) -> str:
    def one(match: re.Match[str]) -> str:
        token = match[1]
        return chr(int(token[1:], 16)) if len(token) == 5 else ESCAPES.get(token, token)

    return re.sub(r"\\(u[0-9a-fA-F]{4}|.)", one, text, flags=re.DOTALL)


def spdx_licence(words: str) -> str:
    """SPDX identifier for the licence line of a furniture catalog; CatalogError if unknown."""
    if "United States" in words and "Attribution 3.0" in words:
        return "CC-BY-3.0-US"
    if "Attribution 3.0" in words:
        return "CC-BY-3.0"
    if "Public domain" in words:
        return "CC0-1.0"
    raise CatalogError(f"unknown licence: {words!r}")


def read_catalog(archive: Path) -> list[Model]:
    """The models of one .sh3f archive, in the order of its catalog."""
    try:
        with zipfile.ZipFile(archive) as opened:
            entries = parse_properties(opened.read(CATALOG).decode("latin-1"))
    except (zipfile.BadZipFile, KeyError, OSError) as error:
        raise CatalogError(f"{archive}: not a furniture archive: {error}") from error
    numbers = [int(key[6:]) for key in entries if re.fullmatch(r"model#\d+", key)]
    try:
        return [_model(entries, number, archive.stem) for number in sorted(numbers)]
    except KeyError as error:
        raise CatalogError(f"{archive}: the catalog lacks {error}") from error


def _model(entries: dict[str, str], number: int, archive: str) -> Model:
    return Model(
        path=entries[f"model#{number}"].lstrip("/"),
        name=entries[f"name#{number}"].strip(),
        category=entries[f"category#{number}"].strip(),
        creator=entries[f"creator#{number}"].strip(),
        licence=spdx_licence(entries.get(f"license#{number}", entries["license"])),
        archive=archive,
    )


def read_catalogs(folder: Path) -> list[Model]:
    """All models of the five archives in `folder`, sorted by path. CatalogError if one lacks."""
    models = [model for name in ARCHIVES for model in read_catalog(folder / f"{name}.sh3f")]
    models.sort(key=lambda model: model.path)
    twice = {a.path for a, b in pairwise(models) if a.path == b.path}
    if twice:
        raise CatalogError(f"paths that occur twice: {sorted(twice)[:3]}")
    return models


def read_objects(folder: Path, models: list[Model]) -> Iterator[tuple[Model, bytes]]:
    """Each model with the bytes of its OBJ file; every archive is opened once."""
    opened: dict[str, zipfile.ZipFile] = {}
    try:
        for model in models:
            if model.archive not in opened:
                opened[model.archive] = zipfile.ZipFile(folder / f"{model.archive}.sh3f")
            yield model, opened[model.archive].read(model.path)
    finally:
        for archive in opened.values():
            archive.close()


def sha256(data: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def stable_seed(*parts: str | int) -> int:
    """A seed of 64 bits from words and numbers, the same on every machine and in every run."""
    digest = hashlib.sha256("\0".join(str(part) for part in parts).encode()).digest()
    return int.from_bytes(digest[:8], "little")
