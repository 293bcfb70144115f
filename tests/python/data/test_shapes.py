"""Loading shape sets in the layout of the authors' HDF5 files, ours and theirs."""

import dataclasses

import h5py
import numpy as np
import pytest

from vnreg_train.data.modelnet40 import CATEGORIES
from vnreg_train.data.shapes import ShapesError, ShapeSet, load_shapes

M, P, Q = 7, 300, 200


def authors_arrays(rows: int, seed: int) -> dict[str, np.ndarray]:
    """Every point's x tells its column, its y its row, so that selections can be checked."""
    rng = np.random.default_rng(seed)
    column = np.broadcast_to(np.arange(P) / P, (rows, P))
    row = np.broadcast_to(np.arange(rows)[:, None] / 10, (rows, P))
    return {
        "data": np.stack([column, row, np.full((rows, P), seed)], -1).astype("float32"),
        "label": rng.integers(0, 40, (rows, 1)),
        "points": np.stack([column, row, column], -1)[:, :Q].astype("float32"),
        "occupancies": (column[:, :Q] > 0.3).astype("float32"),
    }


def write(path, arrays, **kwargs) -> None:
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file.create_dataset(name, data=values, **kwargs)


@pytest.fixture
def folder(tmp_path):
    """Two training files and one test file, chunked and compressed as large files are."""
    for name, rows, seed in (("train0", M, 1), ("train1", 20, 2), ("test0", 3, 3)):
        arrays = authors_arrays(rows, seed)
        write(tmp_path / f"{name}.h5", {"data": arrays.pop("data")}, chunks=(2, 64, 3))
        with h5py.File(tmp_path / f"{name}.h5", "a") as file:
            for key, values in arrays.items():
                file[key] = values
    return tmp_path


def test_the_authors_folder(folder):
    shapes = load_shapes(folder, "train")
    assert len(shapes) == M + 20
    assert shapes.surface.shape == (M + 20, P, 3)
    assert shapes.surface.dtype == np.float32
    assert shapes.queries.shape == (M + 20, Q, 3)
    assert shapes.occupancies.dtype == np.uint8
    assert shapes.categories == CATEGORIES
    assert shapes.names[0] == "train0/0000"
    assert shapes.names[-1] == "train1/0019"
    assert len(set(shapes.names)) == M + 20
    assert (shapes.surface[:M, 0, 2] == 1).all()
    assert (shapes.surface[M:, 0, 2] == 2).all()
    assert len(load_shapes(folder, "test")) == 3
    assert len(load_shapes(folder / "train1.h5", "train")) == 20


def test_one_random_set_of_columns_for_all_shapes(folder):
    shapes = load_shapes(folder, "train", points=50, queries=20)
    assert shapes.surface.shape == (M + 20, 50, 3)
    columns = shapes.surface[:, :, 0]
    assert (columns == columns[0]).all()
    assert len(np.unique(columns[0])) == 50
    assert np.allclose(shapes.surface[M:, 0, 1], np.arange(20) / 10)
    assert ((shapes.queries[:, :, 0] > 0.3) == shapes.occupancies).all()
    again = load_shapes(folder, "train", points=50, queries=20)
    assert np.array_equal(again.surface, shapes.surface)
    other = load_shapes(folder, "train", points=50, queries=20, seed=1)
    assert not np.array_equal(other.surface, shapes.surface)
    assert load_shapes(folder, "train", points=50, queries=0).queries is None
    with pytest.raises(ShapesError, match="301 points asked for, the file holds 300"):
        load_shapes(folder, "train", points=301)


def test_names_and_categories_of_our_files(tmp_path):
    arrays = authors_arrays(2, 1)
    arrays["label"] = np.array([[1], [0]])
    write(tmp_path / "validation.h5", arrays)
    with h5py.File(tmp_path / "validation.h5", "a") as file:
        file.create_dataset("names", data=["\xe9t\xe9", "b"], dtype=h5py.string_dtype())
        file.attrs["categories"] = ["Bedroom", "Kitchen"]
    shapes = load_shapes(tmp_path, "validation")
    assert shapes.names == ("\xe9t\xe9", "b")
    assert shapes.categories == ("Bedroom", "Kitchen")


def test_labels_beyond_modelnet_get_plain_categories(tmp_path):
    arrays = authors_arrays(2, 1) | {"label": np.array([[54], [3]])}
    write(tmp_path / "test.h5", arrays)
    shapes = load_shapes(tmp_path, "test")
    assert len(shapes.categories) == 55
    assert shapes.categories[54] == "category 54"


def test_files_without_queries(tmp_path):
    arrays = authors_arrays(2, 1)
    write(tmp_path / "test.h5", {"data": arrays["data"], "label": arrays["label"]})
    assert load_shapes(tmp_path, "test").queries is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"data": None}, "'data' is missing"),
        ({"label": None}, "'label' is missing"),
        ({"points": None}, "'points' is missing"),
        ({"data": np.zeros((2, 9))}, r"'data' has shape \(2, 9\)"),
        ({"data": np.zeros((2, 9, 2))}, r"'data' has shape \(2, 9, 2\)"),
        ({"label": np.zeros(2)}, r"'label' has shape \(2,\)"),
        ({"label": np.zeros((3, 1))}, "'label' has 3 rows, data 2"),
        ({"points": np.zeros((3, Q, 3))}, "'points' has 3 rows, data 2"),
        ({"occupancies": np.zeros((2, Q + 1))}, "queries must be"),
        ({"label": np.full((2, 1), -1)}, "label must be indices of 40 categories"),
        ({"data": np.full((2, P, 3), np.nan)}, "surface must be finite"),
        ({"data": np.zeros((2, 0, 3))}, "surface must be .* P > 0"),
    ],
)
def test_malformed_files_are_refused(tmp_path, change, message):
    arrays = authors_arrays(2, 1) | change
    write(tmp_path / "test.h5", {key: a for key, a in arrays.items() if a is not None})
    with pytest.raises(ShapesError, match=message):
        load_shapes(tmp_path, "test")


def test_what_is_no_shape_set(tmp_path):
    with pytest.raises(ShapesError, match=r"no test\*.h5 or ply_data_test\*.h5, no <category>"):
        load_shapes(tmp_path, "test")
    (tmp_path / "test.h5").write_bytes(b"not HDF5")
    with pytest.raises(ShapesError, match="not a readable HDF5 file"):
        load_shapes(tmp_path, "test")


def test_files_that_do_not_fit_together(tmp_path):
    write(tmp_path / "test0.h5", authors_arrays(2, 1))
    arrays = authors_arrays(2, 1)
    write(tmp_path / "test1.h5", arrays | {"data": arrays["data"][:, :-1]})
    with pytest.raises(ShapesError, match="different numbers of points"):
        load_shapes(tmp_path, "test")
    write(tmp_path / "test1.h5", {key: arrays[key] for key in ("data", "label")})
    with pytest.raises(ShapesError, match="'points' is missing"):
        load_shapes(tmp_path, "test")
    write(tmp_path / "test1.h5", arrays | {"label": np.full((2, 1), 50)})
    with pytest.raises(ShapesError, match="different categories"):
        load_shapes(tmp_path, "test")


def test_subset(random_shapes):
    part = random_shapes.subset([3, 0])
    assert part.names == ("d", "a")
    assert np.array_equal(part.queries, random_shapes.queries[[3, 0]])
    assert len(random_shapes.subset(slice(1, 4))) == 3
    assert random_shapes.subset(random_shapes.label == 1).names == ("b", "d")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"surface": np.zeros((5, 10, 3))}, "surface must be float32"),
        ({"surface": np.zeros((5, 10), np.float32)}, "surface must be"),
        ({"label": np.zeros(4, np.int64)}, "label must be"),
        ({"names": ("a",)}, "names must be 5 long"),
        ({"queries": None}, "queries must be both or none"),
        ({"categories": ("one",)}, "indices of 1 categories"),
    ],
)
def test_inconsistent_sets_are_refused(random_shapes, change, message):
    with pytest.raises(ShapesError, match=message):
        dataclasses.replace(random_shapes, **change)


def test_an_empty_set_is_a_set():
    empty = ShapeSet(np.zeros((0, 4, 3), np.float32), np.zeros(0, np.int64), (), ())
    assert len(empty) == 0
