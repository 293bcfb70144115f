"""Builds the furniture set: three HDF5 files in the layout of the paper authors' ModelNet40."""

from __future__ import annotations

import hashlib
import os
import shutil
import zipfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import astuple
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from tqdm import tqdm

from vnreg_train.data.furniture import (
    BUILDER_VERSION,
    QUERY_POINTS,
    SURFACE_POINTS,
    SampledShape,
    sample_shape,
)
from vnreg_train.data.furniture_split import SplitRow, check_digest, read_split
from vnreg_train.data.package import fetch_archives

TEXTS = {"names": "model", "titles": "name", "creators": "creator", "licences": "licence"}


def build_furniture(
    out: Path,
    cache: Path,
    splits: Sequence[str] = ("train", "validation", "test"),
    occupancy: bool = True,
    jobs: int = 2,
) -> list[Path]:
    """Build out/{split}.h5 for every split; files that are complete already stay as they are.

    The furniture package is fetched into `cache` when it is needed and not there. A file holds,
    for M models of P = 16,384 surface points and Q = 8,192 queries (see `write_split_file`),
    `data` (M, P, 3) float32, `label` (M, 1) int64, `points` (M, Q, 3) float32 and
    `occupancies` (M, Q) uint8. With `occupancy` off the last two are left out; a later call
    adds them. Raises PackageError, SplitError (another package version) or MeshError.
    """
    rows = read_split()
    unknown = set(splits) - {row.split for row in rows}
    if unknown:
        raise ValueError(f"unknown splits {sorted(unknown)}")
    categories = sorted({row.category for row in rows})
    paths = []
    for split in splits:
        chosen = [row for row in rows if row.split == split]
        path = out / f"{split}.h5"
        missing = missing_parts(path, chosen, occupancy)
        if missing:
            folder, version = fetch_archives(cache)
            out.mkdir(parents=True, exist_ok=True)
            write_split_file(path, chosen, categories, folder, version, missing, jobs)
        paths.append(path)
    return paths


def rows_digest(rows: Sequence[SplitRow]) -> str:
    """SHA-256 of what a split file is made from: its rows of the split list, in order."""
    return hashlib.sha256(repr([astuple(row) for row in rows]).encode()).hexdigest()


def missing_parts(path: Path, rows: Sequence[SplitRow], occupancy: bool) -> set[str]:
    """Which of the parts "surface" and "queries" the file at `path` lacks for these rows.

    A file of another builder version, or of other rows, counts as absent.
    """
    wanted = {"surface", "queries"} if occupancy else {"surface"}
    try:
        with h5py.File(path, "r") as file:
            same = file.attrs.get("builder_version") == BUILDER_VERSION
            if not same or file.attrs.get("rows_sha256") != rows_digest(rows):
                return wanted
            return wanted & ({"queries"} if "occupancies" not in file else set())
    except OSError:
        return wanted


def write_split_file(
    path: Path,
    rows: Sequence[SplitRow],
    categories: Sequence[str],
    folder: Path,
    package_version: str,
    parts: set[str],
    jobs: int,
) -> None:
    """Write one file, or add the queries to it, under a temporary name that is then renamed."""
    partial_path = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        if "surface" not in parts:
            shutil.copyfile(path, partial_path)
        with h5py.File(partial_path, "a") as file:
            if "surface" in parts:
                _write_labels(file, rows, categories)
            _create_datasets(file, len(rows), parts)
            samples = _sampled(rows, folder, parts, jobs)
            for index, shape in enumerate(tqdm(samples, path.stem, len(rows), unit="model")):
                _write_shape(file, index, shape)
            file.attrs["package_version"] = package_version
            file.attrs["builder_version"] = BUILDER_VERSION
            file.attrs["rows_sha256"] = rows_digest(rows)
        os.replace(partial_path, path)
    finally:
        partial_path.unlink(missing_ok=True)


def _create_datasets(file: h5py.File, models: int, parts: set[str]) -> None:
    def create(name: str, shape: tuple[int, ...], dtype: str) -> None:
        file.create_dataset(name, shape, dtype, chunks=(1, *shape[1:]))

    if "surface" in parts:
        create("data", (models, SURFACE_POINTS, 3), "float32")
    if "queries" in parts:
        create("points", (models, QUERY_POINTS, 3), "float32")
        create("occupancies", (models, QUERY_POINTS), "uint8")


def _write_labels(file: h5py.File, rows: Sequence[SplitRow], categories: Sequence[str]) -> None:
    labels = [categories.index(row.category) for row in rows]
    file["label"] = np.array(labels, dtype=np.int64)[:, None]
    for dataset, field in TEXTS.items():
        file.create_dataset(
            dataset, data=[getattr(row, field) for row in rows], dtype=h5py.string_dtype()
        )
    file.attrs["categories"] = list(categories)


def _write_shape(file: h5py.File, index: int, shape: SampledShape) -> None:
    if shape.surface is not None:
        file["data"][index] = shape.surface
    if shape.queries is not None:
        file["points"][index] = shape.queries
        file["occupancies"][index] = shape.occupancies


def _sampled(
    rows: Sequence[SplitRow], folder: Path, parts: set[str], jobs: int
) -> Iterator[SampledShape]:
    """The samples of every row, in order, from `jobs` processes."""
    work: Any = partial(_sample_row, folder, parts)
    if jobs <= 1:
        yield from map(work, rows)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield from pool.map(work, rows, chunksize=4)


def _sample_row(folder: Path, parts: set[str], row: SplitRow) -> SampledShape:
    with zipfile.ZipFile(folder / f"{row.archive}.sh3f") as archive:
        obj = archive.read(row.model)
    check_digest(row, obj)
    return sample_shape(row.model, obj, "surface" in parts, "queries" in parts)
