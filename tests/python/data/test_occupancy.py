"""Inside or outside, against analytic answers, however the triangles face."""

import numpy as np
import pytest
from data_solids import (
    both_sides,
    box,
    inside_box,
    inverted,
    joined,
    randomly_flipped,
    soup,
    sphere,
)

from vnreg_train.data.mesh import Mesh, welded
from vnreg_train.data.occupancy import label_queries, sample_queries
from vnreg_train.data.orientation import oriented_outward

SOLIDS = {
    "sphere": (sphere(steps=128), lambda q: np.linalg.norm(q, axis=1) < 0.5),
    "box": (box((1, 0.5, 0.3)), inside_box((1, 0.5, 0.3))),
    "thin board": (box((1, 0.5, 0.01)), inside_box((1, 0.5, 0.01))),
    "box with a cavity": (
        joined(box((1, 1, 1)), inverted(box((0.6, 0.6, 0.6)))),
        lambda q: inside_box((1, 1, 1))(q) & ~inside_box((0.6, 0.6, 0.6))(q),
    ),
    "crossing boxes": (
        joined(box((1, 0.2, 0.2)), box((0.2, 0.9, 0.2), (0.3, 0, 0))),
        lambda q: inside_box((1, 0.2, 0.2))(q) | inside_box((0.2, 0.9, 0.2), (0.3, 0, 0))(q),
    ),
    "boxes apart": (
        joined(box((0.3, 0.3, 1), (-0.3, 0, 0)), box((0.3, 0.3, 0.9), (0.3, 0, 0))),
        lambda q: (
            inside_box((0.3, 0.3, 1), (-0.3, 0, 0))(q) | inside_box((0.3, 0.3, 0.9), (0.3, 0, 0))(q)
        ),
    ),
}
DEFECTS = {
    "as given": lambda mesh: mesh,
    "inverted": inverted,
    "randomly flipped": randomly_flipped,
    "both sides": both_sides,
    "soup": lambda mesh: soup(randomly_flipped(mesh)),
}
QUERIES = 8192


@pytest.mark.parametrize("defect", DEFECTS)
@pytest.mark.parametrize("solid", SOLIDS)
def test_known_solids(solid, defect):
    mesh, is_inside = SOLIDS[solid]
    mesh = welded(DEFECTS[defect](mesh))
    queries = sample_queries(mesh, QUERIES, np.random.default_rng(0))
    wrong = label_queries(mesh, queries) != is_inside(queries.astype(np.float64))
    facets = 0.0015 if solid == "sphere" else 0.0
    assert wrong.mean() <= facets


def test_a_solid_inside_a_solid_stays_solid():
    mesh = joined(box((1, 1, 1)), box((0.6, 0.6, 0.6)))
    for one in (mesh, inverted(mesh)):
        queries = sample_queries(one, QUERIES, np.random.default_rng(0))
        assert (label_queries(one, queries) == inside_box((1, 1, 1))(queries)).all()


def solid_angle_of_lid(q: np.ndarray) -> np.ndarray:
    """Solid angle of the square [-0.5, 0.5]^2 at z = 0.5 as seen from q, positive from below."""
    height = 0.5 - q[:, 2]
    total = np.zeros(len(q))
    for x in (-0.5, 0.5):
        for y in (-0.5, 0.5):
            a, b = x - q[:, 0], y - q[:, 1]
            total += np.sign(x * y) * np.arctan(a * b / (height * np.sqrt(a**2 + b**2 + height**2)))
    return total


@pytest.mark.parametrize("defect", ["as given", "inverted", "randomly flipped"])
def test_an_open_box_closes_smoothly(defect):
    closed = box((1, 1, 1))
    top = (closed.vertices[closed.triangles][:, :, 2] > 0.4).all(axis=1)
    assert top.sum() == 2
    mesh = DEFECTS[defect](Mesh(closed.vertices, closed.triangles[~top]))
    queries = np.random.default_rng(0).uniform(-0.55, 0.55, (QUERIES, 3)).astype(np.float32)
    exact = queries.astype(np.float64)
    winding = inside_box((1, 1, 1))(exact) - solid_angle_of_lid(exact) / (4 * np.pi)
    decided = np.abs(winding - 0.5) > 0.01
    labels = label_queries(mesh, queries)
    assert (labels == (winding > 0.5))[decided].all()
    assert labels[np.linalg.norm(exact, axis=1) < 0.3].all()


def test_a_single_sheet_encloses_nothing():
    mesh = Mesh(box((1, 1, 1)).vertices, box((1, 1, 1)).triangles[:2])
    queries = np.random.default_rng(0).uniform(-1, 1, (2000, 3)).astype(np.float32)
    assert label_queries(mesh, queries).mean() < 0.001


def test_orientation_is_repeatable_and_outward():
    mesh = randomly_flipped(sphere())
    one, two = oriented_outward(mesh), oriented_outward(mesh)
    assert np.array_equal(one.triangles, two.triangles)
    a, b, c = (one.vertices[one.triangles[:, k]] for k in range(3))
    assert (np.einsum("tk,tk->t", np.cross(b - a, c - a), a + b + c) >= 0).all()


def test_queries_are_half_uniform_and_half_near():
    mesh = box((1, 0.5, 0.3))
    queries = sample_queries(mesh, QUERIES, np.random.default_rng(0))
    assert queries.shape == (QUERIES, 3)
    assert queries.dtype == np.float32
    outside = np.maximum(np.abs(queries) - np.array([0.5, 0.25, 0.15]), 0)
    inside = np.min(np.array([0.5, 0.25, 0.15]) - np.abs(queries), axis=1)
    distance = np.where(inside > 0, inside, np.linalg.norm(outside, axis=1))
    assert 0.5 < (distance < 0.09).mean() < 0.8
    assert 0.69 < (np.abs(queries[:, 2]) < 0.25).mean() < 0.76
    assert 0.52 < np.abs(queries).max() < 0.7
    first, second = queries[: QUERIES // 2], queries[QUERIES // 2 :]
    assert abs((np.abs(first[:, 2]) < 0.25).mean() - (np.abs(second[:, 2]) < 0.25).mean()) < 0.05
