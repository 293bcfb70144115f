"""OFF text with and without ModelNet40's header defect."""

import numpy as np
import pytest
from data_solids import box, off_text
from hypothesis import given
from hypothesis import strategies as st

from vnreg_train.data.mesh import MeshError, triangle_areas
from vnreg_train.data.off import parse_off


@pytest.mark.parametrize(
    "header", [b"OFF\n8 12 0\n", b"OFF8 12 0\n", b"OFF 8 12 0\n", b"OFF\r\n8 12\n"]
)
def test_header_forms(header):
    text = off_text(box((1, 2, 3))).replace(b"OFF\n8 12 0\n", b"# made by a test\n\n" + header)
    mesh = parse_off(text)
    assert mesh.vertices.shape == (8, 3)
    assert np.isclose(triangle_areas(mesh).sum(), 22)


def test_polygons_and_face_colours():
    mesh = parse_off(b"OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n2 0 1\n")
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


@given(st.integers(0, 214))
def test_a_file_cut_anywhere_is_refused(kept):
    text = off_text(box((1, 1, 1)))
    try:
        parse_off(text[:kept])
    except MeshError as error:
        assert str(error)
    else:
        assert kept == 214  # only the last line end is gone


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "does not begin with OFF"),
        (b"ply\n", "does not begin with OFF"),
        (b"OFF\n", "no counts"),
        (b"OFF\n8 x 0\n", "no counts"),
        (b"OFF\n-1 2 0\n", "negative counts"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n", "truncated: 3 vertices and 1 faces promised, 2 lines"),
        (b"OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "no three numbers"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n", "a face of 3 corners names 2"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\nx 0 1 2\n", "not a face"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "outside"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n", "not finite"),
        (b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "empty mesh"),
    ],
)
def test_broken_text_is_refused(text, message):
    with pytest.raises(MeshError, match=message):
        parse_off(text)
