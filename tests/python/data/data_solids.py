"""Solids with known insides, and files made from them, for the tests of vnreg_train.data."""

from __future__ import annotations

import itertools
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vnreg_train.data.catalog import ARCHIVES, CATALOG
from vnreg_train.data.mesh import Mesh

LICENCE_LINES = {
    "BlendSwap-CC-0": "Public domain",
    "BlendSwap-CC-BY": "Creative Commons Attribution 3.0 license",
    "KatorLegaz": "Creative Commons Attribution 3.0 United States license \xa9 K & L",
    "Reallusion": "Creative Commons Attribution 3.0 United States license",
    "Scopia": "Creative Commons Attribution 3.0 Unported license",
}


def box(size, centre=(0.0, 0.0, 0.0)) -> Mesh:
    """A closed box of 12 triangles that face outward."""
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Mesh(corners * np.array(size) + np.array(centre), np.array(triangles))


def sphere(radius: float = 0.5, steps: int = 48) -> Mesh:
    """A closed sphere of latitudes and longitudes, corners on the sphere, facing outward."""
    polar, around = np.pi * np.arange(steps + 1) / steps, 2 * np.pi * np.arange(steps) / steps
    grid = np.stack(
        [
            np.sin(polar)[:, None] * np.cos(around),
            np.sin(polar)[:, None] * np.sin(around),
            np.repeat(np.cos(polar)[:, None], steps, axis=1),
        ],
        axis=-1,
    )
    index = np.arange((steps + 1) * steps).reshape(steps + 1, steps)
    a, b = index[:-1], index[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return Mesh(radius * grid.reshape(-1, 3), triangles)


def inverted(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.triangles[:, ::-1])


def joined(*meshes: Mesh) -> Mesh:
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([m.triangles + k for m, k in zip(meshes, offsets[:-1], strict=True)]),
    )


def soup(mesh: Mesh) -> Mesh:
    """The same triangles, each with vertices of its own."""
    corners = mesh.vertices[mesh.triangles].reshape(-1, 3)
    return Mesh(corners, np.arange(len(corners)).reshape(-1, 3))


def both_sides(mesh: Mesh) -> Mesh:
    """Every triangle twice, once facing each way."""
    return Mesh(mesh.vertices, np.concatenate([mesh.triangles, mesh.triangles[:, ::-1]]))


def randomly_flipped(mesh: Mesh, seed: int = 0) -> Mesh:
    flip = np.random.default_rng(seed).random(len(mesh.triangles)) < 0.4
    return Mesh(mesh.vertices, np.where(flip[:, None], mesh.triangles[:, ::-1], mesh.triangles))


def inside_box(size, centre=(0.0, 0.0, 0.0)) -> Callable[[np.ndarray], np.ndarray]:
    return lambda q: (np.abs(q - np.array(centre)) < np.array(size) / 2).all(axis=1)


def obj_text(mesh: Mesh, header: str = "mtllib missing.mtl\n") -> bytes:
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    lines += ["f " + " ".join(str(i + 1) for i in triangle) for triangle in mesh.triangles]
    return (header + "\n".join(lines) + "\n").encode()


def off_text(mesh: Mesh) -> bytes:
    lines = ["OFF", f"{len(mesh.vertices)} {len(mesh.triangles)} 0"]
    lines += [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    lines += ["3 " + " ".join(map(str, triangle)) for triangle in mesh.triangles]
    return ("\n".join(lines) + "\n").encode()


def write_archives(folder: Path, models: dict[str, tuple[str, str, bytes]]) -> Path:
    """Five .sh3f archives with {path: (archive, category, OBJ)}."""
    folder.mkdir(parents=True, exist_ok=True)
    for archive in ARCHIVES:
        inside = {path: m for path, m in models.items() if m[0] == archive}
        lines = ["# Test catalog", "id=Test", f"license={LICENCE_LINES[archive]}"]
        for number, (path, (_, category, _obj)) in enumerate(inside.items(), start=1):
            lines += [
                f"id#{number}=Test\\#{Path(path).stem}",
                f"name#{number}=Thing \\u20ac {number}",
                f"category#{number}={category}",
                f"creator#{number}=Zo\xeb",
                f"model#{number}=/{path}",
            ]
        with zipfile.ZipFile(folder / f"{archive}.sh3f", "w") as opened:
            opened.writestr(CATALOG, "\n".join(lines).encode("latin-1"))
            for path, (_, _, obj) in inside.items():
                opened.writestr(path, obj)
    return folder
