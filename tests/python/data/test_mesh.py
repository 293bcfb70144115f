"""Welding, normalisation and sampling of meshes."""

import numpy as np
import pytest
from data_solids import both_sides, box, joined, soup
from hypothesis import given
from hypothesis import strategies as st

from vnreg_train.data.mesh import (
    Mesh,
    MeshError,
    bounding_box,
    checked_mesh,
    normalised,
    sample_surface,
    stretched_to_unit_box,
    triangle_areas,
    welded,
)


@given(
    st.tuples(*[st.floats(0.01, 1e4)] * 3),
    st.tuples(*[st.floats(-1e5, 1e5)] * 3),
)
def test_normalised_is_centred_with_longest_side_one(size, centre):
    low, high = bounding_box(normalised(box(size, centre)))
    assert np.isclose((high - low).max(), 1, atol=1e-6)
    assert np.allclose(low + high, 0, atol=1e-6)


def test_unused_vertices_do_not_count():
    mesh = box((1, 1, 1))
    far = Mesh(np.vstack([mesh.vertices, [[1e6, np.nan, 0]]]), mesh.triangles)
    assert np.allclose(bounding_box(checked_mesh(far.vertices, far.triangles)), [[-0.5], [0.5]])
    assert len(welded(far).triangles) == 12


def test_welding_restores_a_soup_and_drops_second_sides():
    for mesh in (
        soup(box((1, 2, 3))),
        both_sides(box((1, 2, 3))),
        soup(both_sides(box((1, 1, 1)))),
    ):
        merged = welded(mesh)
        assert merged.vertices.shape == (8, 3)
        assert merged.triangles.shape == (12, 3)


def test_welding_keeps_the_first_of_repeated_triangles():
    mesh = box((1, 1, 1))
    assert np.allclose(
        welded(both_sides(mesh)).vertices[welded(both_sides(mesh)).triangles],
        mesh.vertices[mesh.triangles],
    )


def test_sampling_is_uniform_by_area():
    mesh = joined(box((1, 1, 1)), box((1, 1, 1), (5, 0, 0)), box((2, 2, 2), (20, 0, 0)))
    points = sample_surface(mesh, 60_000, np.random.default_rng(0))
    share = np.array([(points[:, 0] < 3).mean(), ((points[:, 0] > 3) & (points[:, 0] < 10)).mean()])
    assert np.allclose(share, 1 / 6, atol=0.01)
    first = points[points[:, 0] < 3]
    assert np.allclose(np.abs(first).max(axis=1), 0.5)
    assert np.allclose(first.mean(axis=0), 0, atol=0.02)
    on_face = first[np.isclose(first[:, 2], 0.5)][:, :2]
    assert np.allclose(on_face.var(axis=0), 1 / 12, atol=0.005)


def test_sampling_never_picks_triangles_without_area():
    mesh = box((1, 1, 1))
    flat = Mesh(mesh.vertices, np.vstack([mesh.triangles, [[0, 0, 1]] * 50]))
    points = sample_surface(flat, 1000, np.random.default_rng(0))
    assert np.allclose(np.abs(points).max(axis=1), 0.5)
    assert np.isclose(triangle_areas(flat).sum(), 6)


def test_stretching_fills_the_unit_cube_but_leaves_a_sheet_thin():
    low, high = bounding_box(stretched_to_unit_box(box((3, 2, 0.1), (1, 1, 1))))
    assert np.allclose(high - low, 1)
    low, high = bounding_box(stretched_to_unit_box(box((3, 2, 0.003))))
    assert np.allclose(high - low, [1, 1, 0.001])


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), int), "empty mesh"),
        (np.zeros((3, 3)), np.zeros((0, 3), int), "empty mesh"),
        (np.eye(3), np.array([[0, 1, 3]]), "vertex index 3 is outside 0..2"),
        (np.eye(3), np.array([[0, 1, -1]]), "vertex index -1"),
        (np.array([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]]), np.array([[0, 1, 2]]), "not finite"),
        (np.array([[0, 0, 0], [1, 0, 0], [2.0, 0, 0]]), np.array([[0, 1, 2]]), "no area"),
        (np.ones((3, 3)), np.array([[0, 1, 2]]), "no area"),
        (np.zeros((3, 2)), np.array([[0, 1, 2]]), r"vertices must be \(V, 3\)"),
        (np.eye(3), np.array([[0, 1, 2, 0]]), r"triangles must be \(T, 3\)"),
    ],
)
def test_bad_meshes_are_refused(vertices, triangles, message):
    with pytest.raises(MeshError, match=message):
        checked_mesh(vertices, triangles)
