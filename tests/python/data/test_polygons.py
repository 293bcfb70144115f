"""Triangulation of polygons."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vnreg_train.data.mesh import Mesh, MeshError, triangle_areas
from vnreg_train.data.polygons import triangulated


def rotation(seed: int) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q


def polygon_area(flat: np.ndarray) -> float:
    x, y = flat.T
    return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@given(st.integers(3, 24), st.integers(0, 1000), st.booleans())
def test_star_shaped_polygons_keep_their_area(corners, seed, clockwise):
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(corners) + 0.8 * rng.random(corners)) / corners
    radius = rng.uniform(0.2, 1.0, corners)
    flat = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if clockwise:
        flat = flat[::-1]
    vertices = np.pad(flat, ((0, 0), (0, 1))) @ rotation(seed)
    triangles = triangulated(vertices, [list(range(corners))])
    assert triangles.shape == (corners - 2, 3)
    areas = triangle_areas(Mesh(vertices, triangles))
    assert np.isclose(areas.sum(), polygon_area(flat), rtol=1e-9)


def test_a_concave_polygon_is_not_a_fan():
    arrow = np.array([[0, 0, 0], [2, 2, 0], [0, 1, 0], [-2, 2, 0.0]])
    for first in range(4):
        face = [(first + k) % 4 for k in range(4)]
        areas = triangle_areas(Mesh(arrow, triangulated(arrow, [face])))
        assert np.isclose(areas.sum(), 2)


def test_polygons_of_many_sizes_keep_their_direction():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [-0.5, 0.5, 0.0]])
    triangles = triangulated(vertices, [[0, 1, 2], [0, 1, 2, 3], [0, 1, 2, 3, 4]])
    assert triangles.shape == (6, 3)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_degenerate_and_crossing_polygons_still_give_triangles():
    vertices = np.array([[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.0]])
    assert triangulated(vertices, [[0, 1, 2, 3]]).shape == (2, 3)
    assert triangulated(vertices, [[0, 0, 0, 0, 4]]).shape == (3, 3)


def test_wrong_indices_are_refused():
    with pytest.raises(MeshError, match=r"outside 0\.\.2"):
        triangulated(np.eye(3), [[0, 1, 2], [0, 1, 2, 3]])
    assert triangulated(np.eye(3), []).shape == (0, 3)
