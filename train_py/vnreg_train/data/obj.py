"""Reader of Wavefront OBJ meshes: vertices and polygons only, every group together."""

from __future__ import annotations

import numpy as np

from vnreg_train.data.mesh import Mesh, MeshError, checked_mesh
from vnreg_train.data.polygons import triangulated


def _vertex(line: bytes, number: int) -> tuple[float, float, float]:
    fields = line.split()
    try:
        return float(fields[1]), float(fields[2]), float(fields[3])
    except (IndexError, ValueError):
        raise MeshError(f"line {number}: not a vertex: {line[:60]!r}") from None


def _face(line: bytes, number: int, vertices: int) -> list[int]:
    """Indices from 0; a negative OBJ index counts back from the latest vertex."""
    try:
        raw = [int(corner.split(b"/", 1)[0]) for corner in line.split()[1:]]
    except ValueError:
        raise MeshError(f"line {number}: not a face: {line[:60]!r}") from None
    face = [index - 1 if index > 0 else vertices + index for index in raw]
    if not raw or 0 in raw or min(face) < 0:
        raise MeshError(f"line {number}: not a face: {line[:60]!r}")
    return face


def parse_obj(text: bytes) -> Mesh:
    """The surface of an OBJ file: all groups and objects, polygons cut into triangles.

    Colours after the coordinates, texture and normal indices, lines, points and materials are
    ignored, and so are faces of one or two corners, which some exporters write for edges.
    Raises MeshError that names the line for malformed text, and for an empty mesh, indices that
    do not exist, vertices that are not finite, or no area.
    """
    positions: list[tuple[float, float, float]] = []
    faces: list[list[int]] = []
    last_short, number, line = 0, 1, b""
    for number, line in enumerate(text.replace(b"\\\n", b" ").split(b"\n"), start=1):
        kind = line[:2]
        if kind in (b"v ", b"v\t"):
            positions.append(_vertex(line, number))
        elif kind in (b"f ", b"f\t"):
            faces.append(_face(line, number, len(positions)))
            if len(faces[-1]) < 3:
                faces.pop()
                last_short = number
    if last_short == number and line:
        raise MeshError(f"line {number}: the file ends within a face: {line[:60]!r}")
    vertices = np.array(positions, dtype=np.float64).reshape(-1, 3)
    return checked_mesh(vertices, triangulated(vertices, faces))
