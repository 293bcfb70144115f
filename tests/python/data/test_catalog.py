"""Catalogs of furniture archives."""

import zipfile

import pytest
from data_solids import box, obj_text, write_archives
from hypothesis import given
from hypothesis import strategies as st

from vnreg_train.data.catalog import (
    CATALOG,
    CatalogError,
    parse_properties,
    read_catalog,
    read_catalogs,
    read_objects,
    sha256,
    spdx_licence,
    stable_seed,
)

CUBE = obj_text(box((1, 1, 1)))
MODELS = {
    "scopia/bed/bed.obj": ("Scopia", "Bedroom", CUBE),
    "scopia/arm/arm.obj": ("Scopia", "Bedroom", CUBE),
    "blendswap-cc-0/lamp/lamp.obj": ("BlendSwap-CC-0", "Lights", CUBE + b"\n"),
    "katorlegaz/car/car.obj": ("KatorLegaz", "Vehicles", CUBE),
}


def test_properties_as_java_reads_them():
    entries = parse_properties(
        "# comment = no\n! neither\na=1\nb : two \nc\\ d=x\\=y\nid#2=S\\#t\n"
        "long=first \\\n    second\neuro=10\\u20ac\nempty=\nbare\ntab\tvalue\npath=C\\\\d\n"
    )
    assert entries == {
        "a": "1",
        "b": "two ",
        "c d": "x=y",
        "id#2": "S#t",
        "long": "first second",
        "euro": "10\u20ac",
        "empty": "",
        "bare": "",
        "tab": "value",
        "path": "C\\d",
    }


@given(st.dictionaries(st.integers(0, 999).map("name#{}".format), st.text("abc =:#!", max_size=9)))
def test_simple_entries_survive(entries):
    text = "".join(f"{key}={value}\n" for key, value in entries.items())
    assert parse_properties(text) == {key: value.lstrip(" ") for key, value in entries.items()}


def test_five_archives(tmp_path):
    models = read_catalogs(write_archives(tmp_path, MODELS))
    assert [model.path for model in models] == sorted(MODELS)
    lamp, car, arm, bed = models
    assert (lamp.licence, car.licence, arm.licence) == ("CC0-1.0", "CC-BY-3.0-US", "CC-BY-3.0")
    assert (arm.archive, arm.creator, arm.category) == ("Scopia", "Zo\xeb", "Bedroom")
    assert bed.name == "Thing \u20ac 1"
    data = {model.path: obj for model, obj in read_objects(tmp_path, models)}
    assert data["blendswap-cc-0/lamp/lamp.obj"] == CUBE + b"\n"


def test_licences():
    assert spdx_licence("Creative Commons Attribution 3.0 license") == "CC-BY-3.0"
    with pytest.raises(CatalogError, match="unknown licence: 'All rights reserved'"):
        spdx_licence("All rights reserved")


def test_missing_and_broken_archives(tmp_path):
    with pytest.raises(CatalogError, match="not a furniture archive"):
        read_catalogs(tmp_path)
    broken = tmp_path / "Scopia.sh3f"
    broken.write_bytes(b"PK\x03\x04 truncated")
    with pytest.raises(CatalogError, match="not a furniture archive"):
        read_catalog(broken)
    with zipfile.ZipFile(broken, "w") as archive:
        archive.writestr("readme.txt", "no catalog")
    with pytest.raises(CatalogError, match="not a furniture archive"):
        read_catalog(broken)
    with zipfile.ZipFile(broken, "w") as archive:
        archive.writestr(CATALOG, "license=Public domain\nmodel#1=/a.obj\nname#1=A\n")
    with pytest.raises(CatalogError, match="lacks 'category#1'"):
        read_catalog(broken)


def test_a_path_that_occurs_twice(tmp_path):
    write_archives(tmp_path, MODELS)
    write_archives(tmp_path / "other", {"scopia/bed/bed.obj": ("Reallusion", "Characters", CUBE)})
    (tmp_path / "other" / "Reallusion.sh3f").replace(tmp_path / "Reallusion.sh3f")
    with pytest.raises(CatalogError, match="occur twice"):
        read_catalogs(tmp_path)


def test_seeds_and_digests_never_change():
    assert stable_seed("surface", 1, "scopia/bed1/bed1.obj") == 14273481354770746145
    assert stable_seed("a", "b") != stable_seed("ab")
    assert sha256(b"abc")[:8] == "ba7816bf"
