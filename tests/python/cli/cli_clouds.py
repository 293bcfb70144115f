"""Writers of cloud files that share nothing with the program: numpy, trimesh, HDF5's LZF."""

from __future__ import annotations

import io
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import trimesh
from cli_program import OK, Program, moved
from numpy.typing import NDArray

Points = NDArray[np.float64]


def _export(path: Path, geometry: Any, file_type: str, **options: str) -> None:
    content = geometry.export(file_type=file_type, **options)
    path.write_bytes(content.encode() if isinstance(content, str) else content)


def _trimesh(path: Path, points: Points, file_type: str, **options: str) -> None:
    cloud: Any = trimesh.PointCloud
    _export(path, cloud(points), file_type, **options)


def _mesh(path: Path, points: Points, file_type: str) -> None:
    faces = np.arange(3 * (len(points) // 3)).reshape(-1, 3)
    _export(path, trimesh.Trimesh(points, faces, process=False), file_type)


def read_ply(path: Path) -> Points:
    """The vertices of a PLY file, as trimesh reads them."""
    geometry: Any = trimesh.load(path)
    assert type(geometry).__name__ == "PointCloud"
    return np.asarray(geometry.vertices, dtype=np.float64)


def ply_big_endian(path: Path, points: Points) -> None:
    """Mixed types, coordinates out of order, a list after the points."""
    rows = np.zeros(
        len(points), [("z", ">f8"), ("red", "u1"), ("x", ">f8"), ("y", ">f8"), ("n", ">i2")]
    )
    for axis, name in enumerate("xyz"):
        rows[name] = points[:, axis]
    header = (
        "ply\r\nformat binary_big_endian 1.0\r\ncomment by numpy\r\n"
        f"element vertex {len(points)}\r\nproperty double z\r\nproperty uchar red\r\n"
        "property double x\r\nproperty double y\r\nproperty short n\r\n"
        "element face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
    )
    path.write_bytes(header.encode() + rows.tobytes() + struct.pack(">B3i", 3, 0, 1, 2))


def _pcd_header(points: Points, data: str) -> bytes:
    return (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\n"
        "SIZE 8 8 8 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS {len(points)}\nDATA {data}\n"
    ).encode()


def pcd_ascii(path: Path, points: Points) -> None:
    text = io.StringIO()
    np.savetxt(text, np.c_[points, np.zeros(len(points))], fmt="%.17g")
    path.write_bytes(_pcd_header(points, "ascii") + text.getvalue().encode())


def pcd_binary(path: Path, points: Points) -> None:
    rows = np.zeros(len(points), [("xyz", "<f8", 3), ("intensity", "<f4")])
    rows["xyz"] = points
    path.write_bytes(_pcd_header(points, "binary") + rows.tobytes())


def pcd_compressed(path: Path, points: Points) -> None:
    """Compressed by the LZF filter of HDF5, whose chunks are plain LZF streams."""
    columns = points.T.astype("<f8").tobytes() + np.zeros(len(points), "<f4").tobytes()
    with h5py.File("memory", "w", driver="core", backing_store=False) as file:
        data = np.frombuffer(columns, np.uint8)
        stored = file.create_dataset("d", data=data, chunks=data.shape, compression="lzf")
        mask, compressed = stored.id.read_direct_chunk((0,))
    assert mask == 0, "the filter gave up: these points do not compress"
    sizes = struct.pack("<II", len(compressed), len(columns))
    path.write_bytes(_pcd_header(points, "binary_compressed") + sizes + compressed)


def text(delimiter: str, header: str = "") -> Callable[[Path, Points], None]:
    """Rows with a fourth column; `header` and a line end come first."""

    def write(path: Path, points: Points) -> None:
        rows = np.c_[points, np.arange(len(points))]
        np.savetxt(path, rows, fmt="%.17g", delimiter=delimiter, header=header, comments="")

    return write


def npy(dtype: str, order: str = "C") -> Callable[[Path, Points], None]:
    def write(path: Path, points: Points) -> None:
        with path.open("wb") as file:  # np.save would add .npy to a bare name
            # NumPy wants a literal for the order.
            np.save(file, np.asarray(points, dtype=dtype, order=order))  # type: ignore[call-overload]

    return write


def off_defect(path: Path, points: Points) -> None:
    """The counts stuck to the keyword, as in many files of ModelNet40."""
    rows = "".join(f"{x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in points)
    path.write_text(f"OFF{len(points)} 0 0\n{rows}")


WRITERS: dict[str, tuple[str, Callable[[Path, Points], None]]] = {
    "ply binary (trimesh)": ("a.ply", lambda p, x: _trimesh(p, x, "ply", encoding="binary")),
    "ply ascii (trimesh)": ("a.ply", lambda p, x: _trimesh(p, x, "ply", encoding="ascii")),
    "ply mesh (trimesh)": ("a.ply", lambda p, x: _mesh(p, x, "ply")),
    "ply big endian": ("a.ply", ply_big_endian),
    "obj mesh (trimesh)": ("a.obj", lambda p, x: _mesh(p, x, "obj")),
    "off mesh (trimesh)": ("a.off", lambda p, x: _mesh(p, x, "off")),
    "off with the defect": ("a.off", off_defect),
    "xyz (trimesh)": ("a.xyz", lambda p, x: _trimesh(p, x, "xyz")),
    "pcd ascii": ("a.pcd", pcd_ascii),
    "pcd binary": ("a.pcd", pcd_binary),
    "pcd compressed": ("a.pcd", pcd_compressed),
    "txt": ("a.txt", text(" ")),
    "csv": ("a.csv", text(",", "x,y,z,index")),
    "csv semicolon": ("a.csv", text(";", "X;Y;Z;index")),
    "tab": ("a.txt", text("\t", "# exported")),
    "npy <f8": ("a.npy", npy("<f8")),
    "npy >f8": ("a.npy", npy(">f8")),
    "npy <f4": ("a.npy", npy("<f4")),
    "npy Fortran": ("a.npy", npy("<f8", "F")),
    "no extension": ("a", npy("<f8")),
}


def read_back(vnreg: Program, model: Path, path: Path) -> Points:
    """What the program reads: the cloud aligned with itself is moved by (nearly) nothing."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "out.ply"
        arguments = ("--json", "--mode=coarse", "--model", model, "-o", output)
        run = vnreg("align", path, path, *arguments)
        assert run.code == OK, run.stderr
        back = np.linalg.inv(np.array(run.json()["T_target_source"]))
        return moved(back, read_ply(output))
