"""The folder of part files. A part appears complete or not at all, under a name that its pairs
determine: whoever writes it, and however often, it is there once."""

from __future__ import annotations

import json
import os
import re
import uuid
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import fsspec
import pyarrow as pa
import pyarrow.parquet
from fsspec.implementations.local import LocalFileSystem

from vnreg._batch.blocks import Block
from vnreg._batch.rows import NAMES, named

SETTINGS = "_vnreg.json"
"""What the parts were made with. Readers of parquet folders skip names that begin with _ or ."""
PART = re.compile(r"part-(\d+)-[0-9a-f]+\.parquet")
TEMPORARY = re.compile(r"\.part-.*\.tmp")


@dataclass(frozen=True)
class OutputFolder:
    url: str
    """Absolute, because the workers' current folders are others."""

    @staticmethod
    def open(url: str, settings: Mapping[str, Any]) -> OutputFolder:
        """Makes the folder, or goes on with one of the same settings; ValueError for others."""
        output = OutputFolder(url if "://" in url else os.path.abspath(url))
        files, path = output._files()
        files.makedirs(path, exist_ok=True)
        wanted = json.dumps(settings, indent=1, sort_keys=True) + "\n"
        if files.exists(f"{path}/{SETTINGS}"):
            found = files.cat_file(f"{path}/{SETTINGS}").decode()
            if found != wanted:
                raise ValueError(f"{url}: {_difference(json.loads(found), settings)}")
        elif output.parts():
            raise ValueError(f"{url}: has parts of unknown settings: no {SETTINGS} beside them")
        else:
            output._put(SETTINGS, wanted.encode())
        return output

    def parts(self) -> dict[int, str]:
        """The names of the complete parts, by number."""
        names = self._names()
        return {int(found[1]): name for name in names if (found := PART.fullmatch(name))}

    def commit(self, name: str, table: pa.Table) -> None:
        """Writes a part. Raises OSError."""
        content = BytesIO()
        pyarrow.parquet.write_table(table, content, compression="zstd")
        self._put(name, content.getvalue())

    def begins(self, name: str, block: Block) -> bool:
        """Whether a part has the first pairs of a block of paths, and fewer than the block."""
        files, path = self._files()
        names = [named(block.first_row + i, pair) for i, pair in enumerate(block.pairs)]
        content = BytesIO(files.cat_file(f"{path}/{name}"))
        found = pyarrow.parquet.read_table(content, columns=NAMES).to_pylist()
        of_paths = all(row["source"] and row["target"] for row in found)
        return of_paths and len(found) < len(names) and found == names[: len(found)]

    def remove(self, name: str) -> None:
        files, path = self._files()
        files.rm_file(f"{path}/{name}")

    def remove_leftovers(self) -> None:
        """What killed workers have begun to write."""
        for name in filter(TEMPORARY.fullmatch, self._names()):
            with suppress(FileNotFoundError):
                self.remove(name)

    def _put(self, name: str, content: bytes) -> None:
        files, path = self._files()
        temporary = f"{path}/.{name}.{uuid.uuid4().hex}.tmp"
        with files.open(temporary, "wb") as file:
            file.write(content)
            if isinstance(files, LocalFileSystem):
                file.flush()
                os.fsync(file.fileno())
        if isinstance(files, LocalFileSystem):
            os.replace(temporary, f"{path}/{name}")
        else:
            files.mv(temporary, f"{path}/{name}")

    def _names(self) -> list[str]:
        files, path = self._files()
        files.invalidate_cache(path)
        return [entry.rpartition("/")[2] for entry in files.ls(path, detail=False)]

    def _files(self) -> tuple[Any, str]:
        files, path = fsspec.url_to_fs(self.url)
        return files, path


def _difference(found: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    names = [n for n in {**found, **wanted} if found.get(n) != wanted.get(n)]
    return "made with other settings: " + ", ".join(
        f"{name} {found.get(name)!r}, now {wanted.get(name)!r}" for name in names
    )
