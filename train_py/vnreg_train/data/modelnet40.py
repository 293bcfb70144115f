"""ModelNet40 as its OFF meshes and as PointNet's samples of them (paper, section IV-A).

The HDF5 form of the paper's authors is read by shapes.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vnreg_train.data.catalog import stable_seed
from vnreg_train.data.mesh import (
    Float32,
    MeshError,
    checked_mesh,
    normalised,
    sample_surface,
    welded,
)
from vnreg_train.data.off import parse_off
from vnreg_train.data.shapes import ShapesError, ShapeSet, load_h5

SURFACE_POINTS = 16_384
_CATEGORIES = """
airplane bathtub bed bench bookshelf bottle bowl car chair cone cup curtain desk door dresser
flower_pot glass_box guitar keyboard lamp laptop mantel monitor night_stand person piano plant
radio range_hood sink sofa stairs stool table tent toilet tv_stand vase wardrobe xbox
"""
CATEGORIES = tuple(_CATEGORIES.split())


def load_off_folder(path: Path, split: str, points: int | None = None) -> ShapeSet:
    """Shapes sampled from path/<category>/<split>/*.off, sorted by category and name.

    Each has `points` (default 16,384) surface points, uniform by area, in the mesh centred at
    its bounding-box centre with longest side 1; a pure function of the file's name and bytes.
    There are no occupancy queries: the meshes are not watertight. Raises ShapesError that names
    the file for a mesh that cannot be sampled.
    """
    files = sorted(path.glob(f"*/{split}/*.off"))
    if not files:
        raise ShapesError(f"{path}: no <category>/{split}/*.off meshes")
    found = {file.parent.parent.name for file in files}
    categories = CATEGORIES if found <= set(CATEGORIES) else tuple(sorted(found))
    surfaces = [_sampled(file, SURFACE_POINTS if points is None else points) for file in files]
    return ShapeSet(
        surface=np.stack(surfaces),
        label=np.array([categories.index(file.parent.parent.name) for file in files], np.int64),
        names=tuple(f"{file.parent.parent.name}/{file.stem}" for file in files),
        categories=categories,
    )


def load_ply_data(files: Sequence[Path], points: int | None = None, seed: int = 0) -> ShapeSet:
    """Shapes of modelnet40_ply_hdf5_2048's files, which lie in the unit sphere, made ours.

    Each is moved to the centre of its bounding box and divided by its longest side; categories are
    those of shape_names.txt beside the files, where there is one. Raises ShapesError.
    """
    shapes = load_h5(files, points, queries=0, seed=seed)
    low, high = shapes.surface.min(1, keepdims=True), shapes.surface.max(1, keepdims=True)
    sides = (high - low).max(2, keepdims=True)
    if not (sides > 0).all():
        raise ShapesError(f"{files[0].parent}: a shape without extent")
    surface = ((shapes.surface - (low + high) / 2) / sides).astype(np.float32)
    names = files[0].parent / "shape_names.txt"
    categories = tuple(names.read_text(encoding="utf-8").split()) if names.exists() else CATEGORIES
    return replace(shapes, surface=surface, categories=categories)


def _sampled(file: Path, points: int) -> Float32:
    try:
        mesh = welded(parse_off(file.read_bytes()))
        mesh = normalised(checked_mesh(mesh.vertices, mesh.triangles))
    except (OSError, MeshError) as error:
        raise ShapesError(f"{file}: {error}") from error
    rng = np.random.default_rng(stable_seed("modelnet40", file.parent.parent.name, file.stem))
    return sample_surface(mesh, points, rng).astype(np.float32)
