"""ModelNet40 as a folder of OFF meshes."""

import numpy as np
import pytest
from data_solids import box, off_text, sphere

from vnreg_train.data.modelnet40 import CATEGORIES, SURFACE_POINTS
from vnreg_train.data.shapes import ShapesError, load_shapes


@pytest.fixture
def folder(tmp_path):
    root = tmp_path / "ModelNet40"
    files = {
        "chair/train/chair_0001.off": off_text(box((10, 20, 5), (3, 0, 0))),
        "chair/test/chair_0002.off": off_text(box((1, 1, 1))).replace(b"OFF\n", b"OFF"),
        "airplane/train/airplane_0001.off": off_text(sphere(7)),
    }
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_bytes(text)
    return root


def test_there_are_forty_categories():
    assert len(set(CATEGORIES)) == 40
    assert list(CATEGORIES) == sorted(CATEGORIES)


def test_a_folder_of_meshes(folder):
    shapes = load_shapes(folder, "train")
    assert shapes.names == ("airplane/airplane_0001", "chair/chair_0001")
    assert shapes.categories == CATEGORIES
    assert [CATEGORIES[label] for label in shapes.label] == ["airplane", "chair"]
    assert shapes.surface.shape == (2, SURFACE_POINTS, 3)
    assert shapes.queries is None
    assert np.allclose(np.linalg.norm(shapes.surface[0], axis=1), 0.5, atol=2e-3)
    assert np.allclose(np.abs(shapes.surface[1]).max(axis=0), [0.25, 0.5, 0.125], atol=1e-6)


def test_the_folder_above_works_too_and_the_header_defect_does_not_matter(folder):
    shapes = load_shapes(folder.parent, "test", points=100)
    assert shapes.names == ("chair/chair_0002",)
    assert shapes.surface.shape == (1, 100, 3)


def test_samples_are_repeatable(folder):
    one, two = load_shapes(folder, "train", 50), load_shapes(folder, "train", 50)
    assert np.array_equal(one.surface, two.surface)


def test_unknown_categories_are_numbered_alphabetically(folder):
    (folder / "chair").rename(folder / "throne")
    shapes = load_shapes(folder, "train", points=10)
    assert shapes.categories == ("airplane", "throne")


def test_a_broken_mesh_is_named(folder):
    path = folder / "chair/train/chair_0001.off"
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(ShapesError, match=r"chair_0001\.off: truncated"):
        load_shapes(folder, "train")
    path.write_bytes(b"")
    with pytest.raises(ShapesError, match=r"chair_0001\.off: not an OFF file"):
        load_shapes(folder, "train")
