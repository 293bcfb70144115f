"""The committed split list, and how it is drawn and checked."""

import collections
import dataclasses

import pytest
from data_solids import box, obj_text, sphere, write_archives
from hypothesis import given, settings
from hypothesis import strategies as st

from vnreg_train.data import furniture_split
from vnreg_train.data.catalog import read_catalogs
from vnreg_train.data.furniture_split import (
    SPLIT_FILE,
    SplitError,
    draw_split,
    make_split,
    read_split,
    verify_objects,
    write_split,
)
from vnreg_train.data.package import PACKAGE, fetch_archives


def test_the_committed_list():
    rows = read_split()
    counts = collections.Counter(row.split for row in rows)
    assert counts == {"train": 575, "validation": 82, "test": 163}
    assert [row.model for row in rows] == sorted(row.model for row in rows)
    licences = collections.Counter(row.licence for row in rows)
    assert licences == {"CC-BY-3.0": 530, "CC0-1.0": 175, "CC-BY-3.0-US": 115}
    assert all(row.creator and len(row.sha256) == 64 for row in rows)
    by_category = collections.Counter((row.category, row.split) for row in rows)
    for category in {row.category for row in rows}:
        total = sum(by_category[category, split] for split in counts)
        assert abs(by_category[category, "test"] - 0.2 * total) <= 2


def test_known_duplicates_share_a_side():
    group = {row.model.split("/")[1]: row.group for row in read_split()}
    assert group["pine"] == group["pineSnow"]
    assert group["billet-10-euros"] == group["billet-50-euros"]
    assert group["window_2x3"] == group["window_4x5"]
    assert group["concept-sedan-01v1"] == group["concept-sedan-01v2"]
    assert group["beige_sofa"] == group["beige_sofa_2seats"]


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 150), st.sampled_from("abcd")), min_size=1, max_size=300))
def test_drawing_keeps_groups_whole(models):
    groups, categories = zip(*models, strict=True)
    splits = draw_split(groups, categories)
    assert splits == draw_split(groups, categories)
    assert set(splits) <= {"train", "validation", "test"}
    assert len({(group, split) for group, split in zip(groups, splits, strict=True)}) == len(
        set(groups)
    )


def test_drawing_balances_categories():
    categories = ["a"] * 200 + ["b"] * 100 + ["c"] * 50
    splits = draw_split(range(350), categories)
    counts = collections.Counter(zip(categories, splits, strict=True))
    for category, total in (("a", 200), ("b", 100), ("c", 50)):
        assert abs(counts[category, "train"] - 0.7 * total) <= 1
        assert abs(counts[category, "test"] - 0.2 * total) <= 1


@pytest.fixture
def archives(tmp_path):
    models = {
        "scopia/a/a.obj": ("Scopia", "Bedroom", obj_text(box((1, 2, 3)))),
        "scopia/b/b.obj": ("Scopia", "Kitchen", obj_text(box((3, 1, 1)))),
        "scopia/c/c.obj": ("Scopia", "Kitchen", obj_text(sphere())),
        "reallusion/d/d.obj": ("Reallusion", "Kitchen", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
    }
    return write_archives(tmp_path / "archives", models)


def test_making_a_split_drops_degenerate_models_with_a_reason(archives, tmp_path):
    rows = {row.model: row for row in make_split(archives)}
    assert rows["reallusion/d/d.obj"].split == "dropped"
    assert rows["reallusion/d/d.obj"].name.endswith("the surface has no area")
    assert rows["scopia/a/a.obj"].group == rows["scopia/b/b.obj"].group
    assert rows["scopia/c/c.obj"].group != rows["scopia/b/b.obj"].group
    write_split(list(rows.values()), tmp_path / "split.csv")
    assert read_split(tmp_path / "split.csv") == list(rows.values())
    verify_objects(rows.values(), archives)


def test_verification_refuses_other_archives(archives):
    rows = make_split(archives)
    changed = [dataclasses.replace(rows[0], sha256="0" * 64), *rows[1:]]
    with pytest.raises(SplitError, match=r"SHA-256 .* differs from the split list"):
        verify_objects(changed, archives)
    extra = dataclasses.replace(rows[0], model="scopia/z/z.obj")
    with pytest.raises(SplitError, match=r"1 listed models lack, first scopia/z/z\.obj"):
        verify_objects([*rows, extra], archives)


def test_the_command_compares_and_writes(archives, tmp_path, capsys):
    path = tmp_path / "split.csv"
    furniture_split.main([str(archives), "--list", str(path), "--write"])
    assert "dropped: 1" in capsys.readouterr().out
    furniture_split.main([str(archives), "--list", str(path)])
    path.write_text(path.read_text().replace("Bedroom", "Office"))
    with pytest.raises(SystemExit, match=r"differs from .*split\.csv"):
        furniture_split.main([str(archives), "--list", str(path)])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("model,split", "model,side", "columns must be"),
        (",train,", ",training,", "unknown split 'training'"),
        (",validation,", ",train,", None),
    ],
)
def test_a_malformed_list_is_refused(tmp_path, old, new, message):
    path = tmp_path / "split.csv"
    path.write_text(SPLIT_FILE.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    if message is None:
        assert read_split(path)
        return
    with pytest.raises(SplitError, match=message):
        read_split(path)


def test_contradictions_in_a_list_are_refused(tmp_path):
    rows = read_split()
    path = tmp_path / "split.csv"
    write_split([*rows, rows[0]], path)
    with pytest.raises(SplitError, match="occurs twice"):
        read_split(path)
    pair = [row for row in rows if "pine" in row.model and row.split == "train"][:2]
    write_split([pair[0], dataclasses.replace(pair[1], group=pair[0].group, split="test")], path)
    with pytest.raises(SplitError, match="another split"):
        read_split(path)
    write_split([dataclasses.replace(rows[0], group="x")], path)
    with pytest.raises(SplitError, match="invalid literal"):
        read_split(path)


@pytest.mark.furniture
def test_the_committed_list_fits_the_package(furniture_folder):
    cache = furniture_folder / "cache"
    if not any(cache.glob(f"{PACKAGE}_*.deb")):
        pytest.skip(f"{cache} does not hold the package")
    folder, _ = fetch_archives(cache)
    rows = read_split()
    verify_objects(rows, folder)
    assert {row.model for row in rows} == {model.path for model in read_catalogs(folder)}
