"""Reader of OFF meshes, with the header defect that ModelNet40 is known for."""

from __future__ import annotations

import numpy as np

from vnreg_train.data.mesh import Mesh, MeshError, checked_mesh
from vnreg_train.data.polygons import triangulated


def parse_off(text: bytes) -> Mesh:
    """The surface of an ASCII OFF file; polygons are cut into triangles.

    The counts may follow the word OFF on the same line, even without a space ("OFF123 456 0"),
    as in many files of ModelNet40. Colours after a face and comments are ignored. Raises
    MeshError for malformed or truncated text, and for what checked_mesh refuses.
    """
    lines = [line.split(b"#", 1)[0].strip() for line in text.split(b"\n")]
    lines = [line for line in lines if line]
    if not lines or not lines[0].startswith(b"OFF"):
        raise MeshError("not an OFF file: it does not begin with OFF")
    lines[0] = lines[0][3:].strip()
    body = lines if lines[0] else lines[1:]
    vertices, faces = _counts(body)
    if len(body) < 1 + vertices + faces:
        raise MeshError(
            f"truncated: {vertices} vertices and {faces} faces promised, "
            f"{len(body) - 1} lines after the counts"
        )
    positions = _vertices(body[1 : 1 + vertices])
    polygons = [_face(line) for line in body[1 + vertices : 1 + vertices + faces]]
    return checked_mesh(positions, triangulated(positions, [p for p in polygons if len(p) > 2]))


def _counts(body: list[bytes]) -> tuple[int, int]:
    try:
        vertices, faces = (int(field) for field in body[0].split()[:2])
    except (IndexError, ValueError):
        raise MeshError(f"no counts of vertices and faces: {body[:1]!r}") from None
    if vertices < 0 or faces < 0:
        raise MeshError(f"negative counts: {vertices} vertices, {faces} faces")
    return vertices, faces


def _vertices(lines: list[bytes]) -> np.ndarray:
    try:
        rows = [[float(field) for field in line.split()[:3]] for line in lines]
        return np.array(rows, dtype=np.float64).reshape(-1, 3)
    except ValueError:
        raise MeshError("a vertex line has no three numbers") from None


def _face(line: bytes) -> list[int]:
    try:
        size, *corners = (int(field) for field in line.split()[: 1 + int(line.split()[0])])
    except (IndexError, ValueError):
        raise MeshError(f"not a face: {line[:60]!r}") from None
    if len(corners) != size:
        raise MeshError(f"a face of {size} corners names {len(corners)}: {line[:60]!r}")
    return corners
