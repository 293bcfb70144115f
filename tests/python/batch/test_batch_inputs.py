"""The pairs that vnreg.batch takes."""

from __future__ import annotations

import gzip
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import dask.dataframe as dd
import numpy as np
import pandas as pd
import pytest
from batch_clouds import assert_as_align, assert_same_rows, pairs_of, results
from distributed import Client

import vnreg


def frame_of(clouds: list[Path], count: int = 9) -> pd.DataFrame:
    """A table with names instead of numbers, a column more, and another order of columns."""
    frame = pd.DataFrame(pairs_of(clouds, count), columns=["source", "target"])
    frame.insert(0, "id", [f"pair {i}" for i in range(count)])
    frame.insert(1, "weight", 1.5)
    return frame[["target", "weight", "id", "source"]]


def as_csv(frame: pd.DataFrame, folder: Path) -> Any:
    frame.to_csv(folder / "pairs.csv", index=False)
    return folder / "pairs.csv"


def as_zipped_csv(frame: pd.DataFrame, folder: Path) -> Any:
    (folder / "pairs.csv.gz").write_bytes(gzip.compress(frame.to_csv(index=False).encode()))
    return str(folder / "pairs.csv.gz")


def as_parquet(frame: pd.DataFrame, folder: Path) -> Any:
    frame.to_parquet(folder / "pairs.parquet", row_group_size=4)
    return f"file://{folder}/pairs.parquet"


def as_parquet_folder(frame: pd.DataFrame, folder: Path) -> Any:
    """Whose parts have numbers without leading zeros, as Dask writes them."""
    (folder / "pairs").mkdir()
    for number, start in ((2, 0), (10, 4), (11, 8)):
        frame[start : start + 4 if number < 11 else None].to_parquet(
            folder / f"pairs/part.{number}.parquet"
        )
    return folder / "pairs"


def as_pandas(frame: pd.DataFrame, folder: Path) -> Any:
    return frame


def as_dask(frame: pd.DataFrame, folder: Path) -> Any:
    return dd.from_pandas(frame, npartitions=4)


def as_iterator(frame: pd.DataFrame, folder: Path) -> Any:
    return zip(frame["source"], frame["target"], frame["id"], strict=True)


@pytest.mark.parametrize(
    "form",
    [
        as_csv,
        as_zipped_csv,
        as_parquet,
        as_parquet_folder,
        as_pandas,
        as_dask,
        as_iterator,
    ],
)
def test_every_form_of_the_pairs_makes_the_same_rows(
    form: Callable[[pd.DataFrame, Path], Any], client: Client, clouds: list[Path], tmp_path: Path
) -> None:
    frame = frame_of(clouds)
    vnreg.batch(form(frame, tmp_path), tmp_path / "out", address=client, part_rows=4)
    rows = results(tmp_path / "out")
    assert rows["id"].tolist() == frame["id"].tolist()
    assert_as_align(rows, list(zip(frame["source"], frame["target"], strict=True)))


def test_a_table_without_a_header(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    pairs = pairs_of(clouds, 3)
    (tmp_path / "pairs.csv").write_text("".join(f"{a},{b},7\n" for a, b in pairs))
    vnreg.batch(tmp_path / "pairs.csv", tmp_path / "out", address=client)
    assert_as_align(results(tmp_path / "out"), pairs)


def test_relative_paths_begin_at_the_table(
    client: Client, clouds: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = clouds[0].parent / "relative.csv"
    table.write_text(f"source,target\n{clouds[0].name},{clouds[1].name}\n")
    monkeypatch.chdir(tmp_path)
    for number, url in enumerate((str(table), f"file://{table}")):
        vnreg.batch(url, f"out{number}", address=client)
        (row,) = results(tmp_path / f"out{number}").itertuples()
        assert (row.source, row.status) != (clouds[0].name, "unreadable")
    monkeypatch.chdir(table.parent)
    vnreg.batch([(clouds[0].name, clouds[1].name)], tmp_path / "list", address=client)
    assert results(tmp_path / "list")["error"].isna().all()


def test_no_pairs_make_no_rows(client: Client, tmp_path: Path) -> None:
    (tmp_path / "none.csv").write_text("source,target\n")
    (tmp_path / "empty.csv").touch()
    for name, pairs in (("a", []), ("b", tmp_path / "none.csv"), ("c", tmp_path / "empty.csv")):
        report = vnreg.batch(pairs, tmp_path / name, address=client)
        assert report.rows == 0 and len(results(tmp_path / name)) == 0
        assert list(results(tmp_path / name).columns)[:3] == ["row", "id", "source"]


def test_pairs_that_come_twice_are_two_rows(
    client: Client, clouds: list[Path], tmp_path: Path
) -> None:
    pairs = [(str(clouds[0]), str(clouds[1]), "same")] * 5
    vnreg.batch(pairs, tmp_path, address=client, part_rows=2)
    rows = results(tmp_path)
    assert rows["row"].tolist() == [0, 1, 2, 3, 4] and set(rows["id"]) == {"same"}
    assert len({tuple(pose) for pose in rows["T_target_source"]}) == 1


def test_arrays_and_objects_go_in(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="requirements/demo.txt is not installed")
    points = [np.load(path) for path in clouds[:2]]
    pairs = [(points[0], points[1]), (trimesh.PointCloud(points[0]), str(clouds[1]))]
    vnreg.batch(pairs, tmp_path, address=client)
    rows = results(tmp_path)
    expected = vnreg.align(*points).T_target_source.ravel()
    for pose in rows["T_target_source"]:
        np.testing.assert_array_equal(pose, expected)
    assert rows["source"].isna().all() and rows["target"].isna().tolist() == [True, False]


def test_large_arrays_make_smaller_parts(client: Client, tmp_path: Path) -> None:
    """Points travel to the workers: a part carries no more than 8 MiB and a pair."""
    cloud = np.random.default_rng(0).normal(size=(120_000, 3))
    vnreg.batch([(cloud, cloud)] * 4, tmp_path, address=client, mode="coarse")
    assert sorted(len(pd.read_parquet(path)) for path in tmp_path.glob("part-*")) == [2, 2]


def test_names_that_are_not_utf_8(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    path = os.fsencode(tmp_path) + b"/caf\xe9.npy"
    with open(path, "wb") as file:
        file.write(clouds[0].read_bytes())
    (tmp_path / "pairs.csv").write_bytes(
        b"\xef\xbb\xbfid,source,target\r\n\xe9,%s,%s\r\n" % (path, os.fsencode(clouds[1]))
    )
    listed = [(os.fsdecode(path), clouds[1], os.fsdecode(b"\xe9"))]
    for number, pairs in enumerate((listed, tmp_path / "pairs.csv")):
        vnreg.batch(pairs, tmp_path / f"out{number}", address=client)
        (row,) = results(tmp_path / f"out{number}").itertuples()
        assert pd.isna(row.error) and row.source.endswith("caf\\xe9.npy") and row.id == "\\xe9"


def test_what_is_no_table_is_refused(client: Client, tmp_path: Path) -> None:
    frame = pd.DataFrame({"a": ["x"], "b": ["y"]})
    with pytest.raises(ValueError, match="expected columns source and target, got a, b"):
        vnreg.batch(frame, tmp_path / "a", address=client)
    frame.to_parquet(tmp_path / "t.parquet")
    with pytest.raises(ValueError, match="expected columns source and target, got a, b"):
        vnreg.batch(tmp_path / "t.parquet", tmp_path / "b", address=client)
    for row in ("ab", ("a",), ("a", "b", "c", "d")):
        with pytest.raises(ValueError, match=r"pairs\[0\]: expected a source, a target"):
            vnreg.batch([row], tmp_path / "c", address=client)
    for cloud in ([[1.0, 2.0], [3.0]], object()):
        with pytest.raises(ValueError, match=r"pairs\[1\]: expected paths or clouds"):
            vnreg.batch([("a", "b"), ("a", cloud)], tmp_path / "c", address=client)
    with pytest.raises(FileNotFoundError):
        vnreg.batch(tmp_path / "none.csv", tmp_path / "d", address=client)


def test_pairs_are_not_read_ahead(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    """Back-pressure: what is read and not yet written is bounded, however many pairs there are."""
    pairs, pulled, ahead = pairs_of(clouds, 60), 0, []

    def endless() -> Iterator[tuple[str, str]]:
        nonlocal pulled
        for pair in pairs:
            ahead.append(pulled - 2 * len(list(tmp_path.glob("part-*"))))
            pulled += 1
            yield pair

    report = vnreg.batch(endless(), tmp_path, address=client, part_rows=2, in_flight=3)
    assert report.rows == 60 and report.most_in_flight == 3
    assert 3 < max(ahead) <= 2 * 3 + 1  # three parts, and a half one that is being filled


def test_importing_vnreg_imports_nothing_of_it() -> None:
    code = (
        "import sys, vnreg\n"
        "heavy = {'dask', 'distributed', 'pyarrow', 'fsspec', 'pandas'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
        "sys.modules['distributed'] = None\n"
        "try:\n    vnreg.batch([], 'nowhere')\n"
        "except ImportError as error:\n    assert \"pip install 'vnreg[batch]'\" in str(error)\n"
        "else:\n    raise SystemExit('no ImportError')\n"
    )
    environment = os.environ | {"PYTHONPATH": str(Path(vnreg.__file__).parents[1])}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)


def test_the_same_values_in_every_order(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    pairs = pairs_of(clouds, 6)
    vnreg.batch(pairs, tmp_path / "a", address=client, part_rows=2)
    vnreg.batch(pairs[::-1], tmp_path / "b", address=client, part_rows=4)
    a, b = results(tmp_path / "a"), results(tmp_path / "b")[::-1].reset_index(drop=True)
    assert_same_rows(a.drop(columns=["row", "id"]), b.drop(columns=["row", "id"]))
