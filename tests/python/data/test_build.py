"""Building split files from small archives."""

import dataclasses

import h5py
import numpy as np
import pytest
from data_solids import box, inside_box, obj_text, sphere, write_archives

from vnreg_train.data import build, furniture
from vnreg_train.data.build import build_furniture, missing_parts
from vnreg_train.data.furniture import sample_shape
from vnreg_train.data.furniture_split import SplitError, make_split
from vnreg_train.data.mesh import MeshError
from vnreg_train.data.shapes import load_shapes

P, Q = furniture.SURFACE_POINTS, furniture.QUERY_POINTS


@pytest.fixture
def source(tmp_path, monkeypatch):
    """Archives of three models in place of the package; the list of their rows to build from."""
    folder = write_archives(
        tmp_path / "archives",
        {
            "scopia/a/a.obj": ("Scopia", "Kitchen", obj_text(box((40, 20, 12), (7, 0, 0)))),
            "scopia/b/b.obj": ("Scopia", "Bedroom", obj_text(sphere())),
            "reallusion/c/c.obj": ("Reallusion", "Kitchen", obj_text(box((1, 1, 2)))),
        },
    )
    sides = {"scopia/a/a.obj": "train", "scopia/b/b.obj": "test", "reallusion/c/c.obj": "train"}
    rows = [
        dataclasses.replace(row, split=sides[row.model], group=k)
        for k, row in enumerate(make_split(folder))
    ]
    calls: list[str] = []
    monkeypatch.setattr(build, "read_split", lambda: rows)
    monkeypatch.setattr(
        build, "fetch_archives", lambda cache: (calls.append("fetched"), (folder, "9.9-1"))[1]
    )
    rows_and_calls = type("Source", (), {"rows": rows, "calls": calls, "folder": folder})
    return rows_and_calls


def test_the_files_have_the_authors_layout_and_more(tmp_path, source):
    out = tmp_path / "out"
    paths = build_furniture(out, tmp_path, ("train", "test"), jobs=1)
    assert [path.name for path in paths] == ["train.h5", "test.h5"]
    with h5py.File(out / "train.h5") as file:
        assert file["data"].shape == (2, P, 3)
        assert file["data"].dtype == np.float32
        assert file["label"].shape == (2, 1)
        assert file["label"].dtype == np.int64
        assert file["points"].shape == (2, Q, 3)
        assert file["points"].dtype == np.float32
        assert file["occupancies"].shape == (2, Q)
        assert file["occupancies"].dtype == np.uint8
        assert file["label"][:].tolist() == [[1], [1]]
        assert list(file["names"].asstr()) == ["reallusion/c/c.obj", "scopia/a/a.obj"]
        assert list(file["licences"].asstr()) == ["CC-BY-3.0-US", "CC-BY-3.0"]
        assert list(file["creators"].asstr()) == ["Zo\xeb", "Zo\xeb"]
        assert list(file.attrs["categories"]) == ["Bedroom", "Kitchen"]
        assert file.attrs["package_version"] == "9.9-1"
        assert file.attrs["builder_version"] == furniture.BUILDER_VERSION
        assert np.allclose(np.ptp(file["data"][1], axis=0), [1, 0.5, 0.3], atol=1e-4)
        assert np.allclose(np.abs(file["data"][1]).max(axis=0), [0.5, 0.25, 0.15], atol=1e-4)
        inside = inside_box((1, 0.5, 0.3))(file["points"][1].astype(np.float64))
        assert (file["occupancies"][1] == inside).mean() > 0.9995


def test_complete_files_stay_and_lacking_queries_are_added(tmp_path, source):
    out = tmp_path / "out"
    build_furniture(out, tmp_path, ("test",), occupancy=False, jobs=1)
    shapes = load_shapes(out, "test")
    assert shapes.queries is None
    before = (out / "test.h5").stat().st_mtime_ns
    build_furniture(out, tmp_path, ("test",), occupancy=False, jobs=1)
    assert (out / "test.h5").stat().st_mtime_ns == before
    assert source.calls == ["fetched"]
    build_furniture(out, tmp_path, ("test",), jobs=1)
    whole = load_shapes(out, "test")
    assert np.array_equal(whole.surface, shapes.surface)
    assert whole.queries.shape == (1, Q, 3)
    before = (out / "test.h5").stat().st_mtime_ns
    build_furniture(out, tmp_path, ("test",), occupancy=False, jobs=1)
    build_furniture(out, tmp_path, ("test",), jobs=1)
    assert (out / "test.h5").stat().st_mtime_ns == before
    assert [path.name for path in out.iterdir()] == ["test.h5"]


def test_processes_give_the_same_bits(tmp_path, source):
    build_furniture(tmp_path / "one", tmp_path, ("train",), jobs=1)
    build_furniture(tmp_path / "two", tmp_path, ("train",), jobs=2)
    one, two = (load_shapes(tmp_path / name, "train") for name in ("one", "two"))
    assert np.array_equal(one.surface, two.surface)
    assert np.array_equal(one.queries, two.queries)
    assert np.array_equal(one.occupancies, two.occupancies)


def test_other_versions_rows_and_broken_files_are_built_anew(tmp_path, source, monkeypatch):
    (path,) = build_furniture(tmp_path, tmp_path, ("test",), occupancy=False, jobs=1)
    rows = [row for row in source.rows if row.split == "test"]
    assert missing_parts(path, rows, False) == set()
    assert missing_parts(path, rows, True) == {"queries"}
    assert missing_parts(path, [*rows, rows[0]], True) == {"surface", "queries"}
    monkeypatch.setattr(build, "BUILDER_VERSION", furniture.BUILDER_VERSION + 1)
    assert missing_parts(path, rows, False) == {"surface"}
    monkeypatch.undo()
    path.write_bytes(path.read_bytes()[:1000])
    assert missing_parts(path, rows, False) == {"surface"}
    assert missing_parts(tmp_path / "none.h5", rows, True) == {"surface", "queries"}


def test_a_wrong_digest_stops_the_build_and_leaves_nothing(tmp_path, source):
    out = tmp_path / "out"
    source.rows[:] = [dataclasses.replace(row, sha256="f" * 64) for row in source.rows]
    with pytest.raises(SplitError, match="differs from the split list"):
        build_furniture(out, tmp_path, ("test",), occupancy=False, jobs=1)
    assert list(out.iterdir()) == []
    with pytest.raises(ValueError, match="unknown splits"):
        build_furniture(out, tmp_path, ("training",))


def test_samples_depend_on_the_model_only():
    text = obj_text(box((1, 2, 3)))
    one, again = sample_shape("a.obj", text), sample_shape("a.obj", text)
    other = sample_shape("b.obj", text)
    assert np.array_equal(one.surface, again.surface)
    assert np.array_equal(one.queries, again.queries)
    assert not np.array_equal(one.surface, other.surface)
    assert np.array_equal(sample_shape("a.obj", text, occupancy=False).surface, one.surface)
    assert np.array_equal(sample_shape("a.obj", text, surface=False).queries, one.queries)
    with pytest.raises(MeshError):
        sample_shape("a.obj", b"v 0 0 0\n")
