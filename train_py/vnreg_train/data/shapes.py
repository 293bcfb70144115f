"""A set of shapes in memory, and its loader for the four layouts on disk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from vnreg_train.data.mesh import Float32, Int64

ROWS_AT_ONCE = 16


class ShapesError(ValueError):
    """A shape set that is missing, malformed or not of one of the known layouts."""


@dataclass(frozen=True)
class ShapeSet:
    """M shapes, each of about longest side 1 and centred.

    surface: (M, P, 3) float32 points on the surface. label: (M,) int64 index into categories.
    names: M unique names. queries: (M, Q, 3) float32 or None. occupancies: (M, Q) uint8, 1 where
    the query lies inside, or None.
    """

    surface: Float32
    label: Int64
    names: tuple[str, ...]
    categories: tuple[str, ...]
    queries: Float32 | None = None
    occupancies: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        count = len(self.surface)
        _require(self.surface.ndim == 3 and self.surface.shape[2] == 3, "surface", "(M, P, 3)")
        _require(self.surface.shape[1] > 0, "surface", "(M, P, 3) with P > 0")
        _require(self.surface.dtype == np.float32, "surface", "float32")
        _require(self.label.shape == (count,), "label", f"({count},)")
        _require(len(self.names) == count, "names", f"{count} long")
        known = count == 0 or 0 <= self.label.min() <= self.label.max() < len(self.categories)
        _require(bool(known), "label", f"indices of {len(self.categories)} categories")
        _require((self.queries is None) == (self.occupancies is None), "queries", "both or none")
        if self.queries is not None and self.occupancies is not None:
            expected = self.occupancies.shape
            _require(expected[:1] == (count,) and len(expected) == 2, "occupancies", "(M, Q)")
            _require(self.queries.shape == (*expected, 3), "queries", f"{(*expected, 3)}")
            _require(self.queries.dtype == np.float32, "queries", "float32")
        _require(bool(np.isfinite(self.surface).all()), "surface", "finite")

    def __len__(self) -> int:
        return len(self.surface)

    def subset(self, indices: Sequence[int] | NDArray[Any] | slice) -> ShapeSet:
        """The shapes at `indices`, in that order."""
        rows = np.arange(len(self))[indices]
        return replace(
            self,
            surface=self.surface[rows],
            label=self.label[rows],
            names=tuple(self.names[row] for row in rows),
            queries=None if self.queries is None else self.queries[rows],
            occupancies=None if self.occupancies is None else self.occupancies[rows],
        )


def _require(good: bool, field: str, expected: str) -> None:
    if not good:
        raise ShapesError(f"{field} must be {expected}")


def load_shapes(
    path: Path,
    split: str,
    points: int | None = None,
    queries: int | None = None,
    seed: int = 0,
) -> ShapeSet:
    """The shapes of one split of the set at `path`, whichever layout it has.

    Layouts: a folder of {train,validation,test}.h5 files built by vnreg_train (or one such
    file); a folder of the paper authors' ModelNet40 files, train*.h5 and test*.h5; PointNet's
    ModelNet40 files, ply_data_{train,test}*.h5, which have no queries; or the ModelNet40 folder
    of OFF meshes, ModelNet40/<category>/{train,test}/*.off.
    `points` and `queries` keep only that many surface points and queries per shape: one random
    set of columns, drawn from `seed`, the same for all shapes, as the authors do (who draw with
    repetition: some 20 of their 2,048 occur twice). None keeps all; queries = 0 reads none.
    Raises ShapesError.
    """
    from vnreg_train.data.modelnet40 import load_off_folder, load_ply_data

    path = Path(path)
    if path.is_file():
        return load_h5([path], points, queries, seed)
    files = sorted(path.glob(f"{split}*.h5"))
    if files:
        return load_h5(files, points, queries, seed)
    files = sorted(path.glob(f"ply_data_{split}*.h5"))
    if files:
        return load_ply_data(files, points, seed)
    if any(path.glob(f"*/{split}/*.off")):
        return load_off_folder(path, split, points)
    if any((path / "ModelNet40").glob(f"*/{split}/*.off")):
        return load_off_folder(path / "ModelNet40", split, points)
    raise ShapesError(
        f"{path}: no {split}*.h5 or ply_data_{split}*.h5, no <category>/{split}/*.off"
    )


def load_h5(
    files: Sequence[Path], points: int | None = None, queries: int | None = None, seed: int = 0
) -> ShapeSet:
    """Shapes of HDF5 files that follow one another (all of one layout). See load_shapes."""
    rng = np.random.default_rng(seed)
    parts: list[ShapeSet] = []
    columns: tuple[Columns, Columns] | None = None
    for path in files:
        try:
            with h5py.File(path, "r") as file:
                if columns is None:
                    columns = _columns(file, path, points, queries, rng)
                parts.append(_read_part(file, path, *columns))
        except OSError as error:
            raise ShapesError(f"{path}: not a readable HDF5 file: {error}") from error
    return concatenated(parts)


Columns = NDArray[np.int64] | slice | None


def _columns(
    file: h5py.File, path: Path, points: int | None, queries: int | None, rng: np.random.Generator
) -> tuple[Columns, Columns]:
    """Which columns of `data` and of `points` to read; None for the latter: none."""
    surface = _picked(_dataset(file, path, "data", 3).shape[1], points, rng)
    if queries == 0 or "occupancies" not in file:
        return surface, None
    return surface, _picked(_dataset(file, path, "points", 3).shape[1], queries, rng)


def _picked(available: int, wanted: int | None, rng: np.random.Generator) -> Columns:
    if wanted is None or wanted == available:
        return slice(None)
    if wanted > available:
        raise ShapesError(f"{wanted} points asked for, the file holds {available} per shape")
    return rng.choice(available, wanted, replace=False).astype(np.int64)


def _dataset(file: h5py.File, path: Path, name: str, rank: int) -> h5py.Dataset:
    found = file.get(name)
    if not isinstance(found, h5py.Dataset):
        raise ShapesError(f"{path}: dataset {name!r} is missing")
    if found.ndim != rank or (rank == 3 and found.shape[2] != 3):
        raise ShapesError(f"{path}: dataset {name!r} has shape {found.shape}")
    if len(found) != len(file["data"]):
        raise ShapesError(f"{path}: {name!r} has {len(found)} rows, data {len(file['data'])}")
    return found


def _read_rows(dataset: h5py.Dataset, columns: Columns, dtype: str) -> NDArray[Any]:
    """Some shapes at a time, so that a large file never lies in memory whole."""
    if isinstance(columns, slice) or columns is None:
        return np.asarray(dataset[:], dtype=dtype)
    read = np.empty((len(dataset), len(columns), *dataset.shape[2:]), dtype)
    step = ROWS_AT_ONCE if dataset.chunks is None else max(ROWS_AT_ONCE, dataset.chunks[0])
    for start in range(0, len(dataset), step):
        read[start : start + step] = dataset[start : start + step][:, columns]
    return read


def _read_part(file: h5py.File, path: Path, surface: Columns, queries: Columns) -> ShapeSet:
    label = np.asarray(_dataset(file, path, "label", 2)[:], dtype=np.int64)[:, 0]
    parts: dict[str, Any] = {
        "surface": _read_rows(_dataset(file, path, "data", 3), surface, "float32"),
        "label": label,
    }
    if queries is not None:
        parts["queries"] = _read_rows(_dataset(file, path, "points", 3), queries, "float32")
        inside = _read_rows(_dataset(file, path, "occupancies", 2), queries, "float32")
        parts["occupancies"] = (inside > 0.5).astype(np.uint8)
    return ShapeSet(
        names=_names(file, path, len(label)), categories=_categories(file, label), **parts
    )


def _names(file: h5py.File, path: Path, count: int) -> tuple[str, ...]:
    if "names" not in file:
        return tuple(f"{path.stem}/{row:04d}" for row in range(count))
    return tuple(str(name) for name in _dataset(file, path, "names", 1).asstr()[:])


def _categories(file: h5py.File, label: Int64) -> tuple[str, ...]:
    if "categories" in file.attrs:
        return tuple(str(category) for category in file.attrs["categories"])
    from vnreg_train.data.modelnet40 import CATEGORIES

    if len(label) == 0 or label.max() < len(CATEGORIES):
        return CATEGORIES
    return tuple(f"category {k}" for k in range(int(label.max()) + 1))


def concatenated(parts: Sequence[ShapeSet]) -> ShapeSet:
    """Shape sets of equal categories and point counts, one after another."""
    first = parts[0]
    if any(part.categories != first.categories for part in parts):
        raise ShapesError("the parts have different categories")
    if any(part.surface.shape[1:] != first.surface.shape[1:] for part in parts):
        raise ShapesError("the parts have different numbers of points")
    queries = [part.queries for part in parts if part.queries is not None]
    occupancies = [part.occupancies for part in parts if part.occupancies is not None]
    if len(queries) not in (0, len(parts)):
        raise ShapesError("only some of the parts have queries")
    return ShapeSet(
        surface=np.concatenate([part.surface for part in parts]),
        label=np.concatenate([part.label for part in parts]),
        names=tuple(name for part in parts for name in part.names),
        categories=first.categories,
        queries=np.concatenate(queries) if queries else None,
        occupancies=np.concatenate(occupancies) if occupancies else None,
    )
