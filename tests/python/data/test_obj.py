"""OBJ text, also as real exporters write it, and broken text."""

import numpy as np
import pytest
from data_solids import box, obj_text
from hypothesis import given
from hypothesis import strategies as st

from vnreg_train.data.mesh import MeshError, triangle_areas
from vnreg_train.data.obj import parse_obj


def test_groups_quads_relative_indices_colours_and_continuations():
    text = b"""# a comment
mtllib missing.mtl
o first
v 0 0 0 0.5 0.5 0.5
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vn 0 0 1
usemtl red
f 1/1/1 2/1/1 3//1 4/1
g second
v\t0 0 1
v 1 0 1
v 1 1 1
f -3 -2 \\
 -1
l 1 2
f 1 2
s off
"""
    mesh = parse_obj(text)
    assert mesh.vertices.shape == (7, 3)
    assert mesh.triangles.tolist() == [[4, 5, 6], [0, 1, 2], [0, 2, 3]]
    assert np.allclose(triangle_areas(mesh), 0.5)


def test_windows_line_ends():
    mesh = parse_obj(obj_text(box((1, 2, 3))).replace(b"\n", b"\r\n"))
    assert np.isclose(triangle_areas(mesh).sum(), 22)


@given(st.integers(0, 1000))
def test_a_file_cut_anywhere_gives_a_mesh_or_a_clear_error(kept):
    text = obj_text(box((1, 1, 1)))
    try:
        parse_obj(text[:kept])
    except MeshError as error:
        assert str(error)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "empty mesh"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "3 vertices, 0 triangles"),
        (b"v 0 0 0\nv 1 0\n", "line 2: not a vertex"),
        (b"v 0 0 x\n", "line 1: not a vertex"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "outside"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "line 4: not a face"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "line 4: not a face"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf a b c\n", "line 4: not a face"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf\t\n", "line 4: not a face"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2", "line 5: the file ends within a face"),
        (b"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "not finite"),
        (b"v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n", "not finite"),
        (b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "no area"),
    ],
)
def test_broken_text_is_refused(text, message):
    with pytest.raises(MeshError, match=message):
        parse_obj(text)
