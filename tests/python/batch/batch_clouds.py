"""Clouds, reading of results, and file systems that fail in the ways that real ones do."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any, ClassVar

import fsspec
import numpy as np
import pandas as pd
from distributed import WorkerPlugin
from fsspec.implementations.memory import MemoryFileSystem

import vnreg


def write_clouds(folder: Path, count: int) -> list[Path]:
    """(240, 3) points of one bent box, each file in another pose and another order."""
    rng = np.random.default_rng(11)
    shape = rng.uniform(-1, 1, (400, 3)) * [0.5, 0.3, 0.15]
    shape[:, 1] += shape[:, 0] ** 2
    paths = [folder / f"scan_{number:02d}.npy" for number in range(count)]
    for path in paths:
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.linalg.det(turn)
        np.save(path, rng.permutation(shape)[:240] @ turn.T + rng.normal(size=3))
    return paths


def pairs_of(clouds: list[Path], count: int) -> list[tuple[str, str]]:
    """`count` pairs, each cloud many times."""
    n = len(clouds)
    return [(str(clouds[i % n]), str(clouds[(3 * i + 1) % n])) for i in range(count)]


def results(folder: Any) -> pd.DataFrame:
    """All rows of an output folder, in the order of its parts."""
    return pd.read_parquet(folder)


def assert_same_rows(a: pd.DataFrame, b: pd.DataFrame) -> None:
    """Bit by bit, but for the times."""
    pd.testing.assert_frame_equal(a.drop(columns="ms"), b.drop(columns="ms"), check_exact=True)


def assert_as_align(rows: pd.DataFrame, pairs: list[tuple[str, str]]) -> None:
    """Every pair once, in its place, with the very numbers of vnreg.align."""
    assert rows["row"].tolist() == list(range(len(pairs)))
    registrar = vnreg.Registrar()
    known: dict[tuple[str, str], vnreg.Result] = {}
    for pair, row in zip(pairs, rows.itertuples(), strict=True):
        if pair not in known:
            known[pair] = registrar.align(*map(vnreg.read_cloud, pair))
        result = known[pair]
        assert (row.source, row.target, row.status) == (*pair, result.status)
        np.testing.assert_array_equal(row.T_target_source, result.T_target_source.ravel())
        for name in ("confidence", "overlap", "rmse", "inlier_distance", "score"):
            np.testing.assert_array_equal(getattr(row, name), getattr(result, name))


class FlakyFileSystem(MemoryFileSystem):
    """Files of memory://, of which each can be read at every third attempt only."""

    protocol = "flaky"

    @classmethod
    def _strip_protocol(cls, path: str) -> str:
        return "/" + path.split("://")[-1].lstrip("/")

    reads: ClassVar[dict[str, int]] = {}

    def cat_file(self, path: str, *args: Any, **kwargs: Any) -> Any:
        self.reads[path] = self.reads.get(path, 0) + 1
        if self.reads[path] % 3 != 0:
            raise TimeoutError(110, "Connection timed out")
        return super().cat_file(path, *args, **kwargs)


class DeadlyFileSystem(MemoryFileSystem):
    """Reading kills the process, as the kernel does where memory is used up."""

    protocol = "deadly"

    def cat_file(self, path: str, *args: Any, **kwargs: Any) -> Any:
        os.kill(os.getpid(), signal.SIGKILL)


class DeadlyFiles(WorkerPlugin):
    """Makes deadly:// known on workers."""

    name = "deadly-files"

    def setup(self, worker: Any) -> None:
        fsspec.register_implementation("deadly", DeadlyFileSystem, clobber=True)
