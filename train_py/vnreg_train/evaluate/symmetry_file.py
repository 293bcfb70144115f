"""The committed list of the symmetries of the shapes: its writer."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from vnreg_train.data.catalog import stable_seed
from vnreg_train.data.furniture_split import check_digest, read_split
from vnreg_train.data.mesh import Mesh, checked_mesh, normalised, welded
from vnreg_train.data.obj import parse_obj
from vnreg_train.data.package import fetch_archives
from vnreg_train.data.shapes import load_shapes
from vnreg_train.evaluate.find_symmetries import LIMIT, SHARE, find_symmetry
from vnreg_train.evaluate.symmetry import SymmetryGroup


def find_furniture_symmetries(
    data: Path, cache: Path, splits: Sequence[str]
) -> dict[str, SymmetryGroup]:
    """The group of every shape of the splits, by name."""
    groups = {}
    for split in splits:
        shapes = load_shapes(data, split, queries=0)
        meshes = furniture_meshes(shapes.names, cache)
        both = zip(shapes.names, meshes, shapes.surface, strict=True)
        for name, mesh, surface in tqdm(both, split, len(shapes), unit="shape"):
            seed = stable_seed("symmetry", name) % 2**32
            groups[name] = find_symmetry(mesh, surface, seed)
    return groups


def furniture_meshes(names: Sequence[str], cache: Path) -> Iterator[Mesh]:
    """The mesh that each model's surface was sampled from, in the samples' frame."""
    rows = {row.model: row for row in read_split()}
    folder, _ = fetch_archives(cache)
    for name in names:
        with zipfile.ZipFile(folder / f"{rows[name].archive}.sh3f") as archive:
            obj = archive.read(name)
        check_digest(rows[name], obj)
        mesh = welded(parse_obj(obj))
        yield normalised(checked_mesh(mesh.vertices, mesh.triangles))


def symmetries_text(groups: Mapping[str, SymmetryGroup]) -> str:
    """JSON with one shape a line."""
    head = {
        "test": f"{SHARE:.0%} of the surface within {LIMIT} of the turned surface, both ways; "
        "lengths in longest sides of the shape",
        "rebuild": "vnreg-train find-symmetries",
    }
    shapes = [f"  {json.dumps(name)}: {json.dumps(_entry(g))}" for name, g in groups.items()]
    fields = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    fields.append(' "shapes": {\n' + ",\n".join(shapes) + "\n }")
    return "{\n" + ",\n".join(fields) + "\n}\n"


def _entry(group: SymmetryGroup) -> dict[str, Any]:
    return {
        "centre": [round(float(value), 5) for value in group.centre],
        "axes": [
            {
                "axis": list(axis.direction),
                "order": axis.order or "continuous",
                "residual": round(axis.residual, 5),
            }
            for axis in group.axes
        ],
    }
