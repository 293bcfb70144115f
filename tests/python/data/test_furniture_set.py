"""The real furniture test split."""

import collections

import h5py
import numpy as np
import pytest

from vnreg_train.data.build import build_furniture
from vnreg_train.data.furniture import SURFACE_POINTS
from vnreg_train.data.furniture_split import read_split
from vnreg_train.data.protocol import make_pair
from vnreg_train.data.shapes import load_shapes

pytestmark = pytest.mark.furniture


def test_the_test_split(furniture_folder):
    shapes = load_shapes(furniture_folder, "test", queries=0)
    rows = [row for row in read_split() if row.split == "test"]
    assert shapes.surface.shape == (len(rows), SURFACE_POINTS, 3)
    assert shapes.names == tuple(row.model for row in rows)
    labels = collections.Counter(shapes.categories[label] for label in shapes.label)
    assert labels == collections.Counter(row.category for row in rows)
    low, high = shapes.surface.min(axis=1), shapes.surface.max(axis=1)
    assert (high - low).max() <= 1 + 1e-6
    assert (high - low).max(axis=1).min() > 0.95
    assert np.abs(low + high).max() < 0.1


def test_a_second_build_changes_nothing(furniture_folder):
    path = furniture_folder / "test.h5"
    before = path.stat().st_mtime_ns
    build_furniture(furniture_folder, furniture_folder / "cache", ("test",), occupancy=False)
    assert path.stat().st_mtime_ns == before


def test_queries_where_they_were_built(furniture_folder):
    with h5py.File(furniture_folder / "test.h5") as file:
        if "occupancies" not in file:
            pytest.skip("the test split was built without occupancies")
        inside = file["occupancies"][:].mean(axis=1)
    assert inside.max() < 0.7
    assert (inside > 0.005).mean() > 0.95


def test_pairs_of_it(furniture_folder):
    shapes = load_shapes(furniture_folder, "test", queries=0)
    for index in range(0, len(shapes), 40):
        pair = make_pair(shapes, index, "partial", 180)
        expected = 1 if pair.same_crop else 2 / 3
        assert abs(pair.overlap - expected) < 0.02
