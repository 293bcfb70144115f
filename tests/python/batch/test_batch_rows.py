"""What stands in the rows of vnreg.batch."""

from __future__ import annotations

import json
from pathlib import Path

import fsspec
import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest
from batch_clouds import FlakyFileSystem, assert_as_align, assert_same_rows, pairs_of, results
from distributed import Client

import vnreg


def test_a_row_has_what_align_says(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    pairs = pairs_of(clouds, 10)
    report = vnreg.batch(pairs, tmp_path, address=client, part_rows=4)
    rows = results(tmp_path)
    assert_as_align(rows, pairs)
    assert (report.rows, report.parts, report.resumed_parts) == (10, 3, 0)
    assert report.statuses == rows["status"].value_counts().to_dict()
    assert rows["id"].tolist() == [str(i) for i in range(10)]
    assert rows["error"].isna().all() and (rows["ms"] > 0).all()
    assert {*rows["points_source"], *rows["points_target"]} == {240}


def test_columns(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    """Those of `vnreg batch` of the program: what reads one reads the other."""
    vnreg.batch(pairs_of(clouds, 1), tmp_path, address=client)
    (part,) = tmp_path.glob("*.parquet")
    schema = pyarrow.parquet.read_schema(part)
    types = {field.name: str(field.type) for field in schema}
    assert types.pop("T_target_source").startswith("list<") and list(types.items()) == [
        ("row", "int64"),
        ("id", "string"),
        ("source", "string"),
        ("target", "string"),
        ("status", "string"),
        ("confidence", "double"),
        ("overlap", "double"),
        ("rmse", "double"),
        ("inlier_distance", "double"),
        ("score", "double"),
        ("points_source", "int64"),
        ("points_target", "int64"),
        ("ms", "double"),
        ("error", "string"),
    ]
    assert json.loads(schema.metadata[b"vnreg"]) == {
        "version": vnreg.__version__,
        "instruction_set": vnreg.instruction_set(),
    }


def test_neither_workers_nor_parts_matter(
    client: Client, clouds: list[Path], tmp_path: Path
) -> None:
    """Two threads here, one process there; parts of 7 rows and of 3."""
    pairs = pairs_of(clouds, 14)
    vnreg.batch(pairs, tmp_path / "a", address=client, part_rows=7)
    report = vnreg.batch(pairs, tmp_path / "b", workers=1, part_rows=3)
    assert report.parts == 5
    assert_same_rows(results(tmp_path / "a"), results(tmp_path / "b"))


def test_failures_are_rows(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    good = str(clouds[0])
    (tmp_path / "empty.ply").touch()
    (tmp_path / "torn.npy").write_bytes(clouds[0].read_bytes()[:-5])
    (tmp_path / "few.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    (tmp_path / "hole.xyz").write_text("0 0 0\n" * 40 + "1 nan 2\n")
    (tmp_path / "spot.xyz").write_text("1 2 3\n" * 40)
    line = np.zeros((50, 2))
    wrong = [
        (tmp_path / "none.ply", "unreadable", "none.ply: expected a file that can be read"),
        (tmp_path, "unreadable", "expected a file that can be read, found Is a directory"),
        (tmp_path / "empty.ply", "unreadable", "empty.ply: expected a point cloud, found an empty"),
        (tmp_path / "torn.npy", "unreadable", "torn.npy: "),
        (tmp_path / "bad\nname.ply", "unreadable", "bad\\x0aname.ply: expected a file"),
        ("what://cloud.ply", "unreadable", "what://cloud.ply: Protocol not known"),
        (None, "unreadable", "expected a path, found nothing"),
        (float("nan"), "unreadable", "expected a path, found nothing"),
        (line, "unreadable", "source: expected shape (N, 3), got (50, 2)"),
        (np.array(["x"]), "unreadable", "source: expected an array of real numbers"),
        (np.full((50, 3), np.nan), "not_finite", "source: point 1: expected finite coordinates"),
        (tmp_path / "hole.xyz", "not_finite", "hole.xyz: point 41: expected finite coord"),
        (tmp_path / "few.xyz", "too_few_points", "few.xyz: expected at least 24 points, found 3"),
        (tmp_path / "spot.xyz", "degenerate", "spot.xyz and "),
    ]
    pairs = [(source, good) for source, _, _ in wrong] + [(good, str(clouds[1]))]
    report = vnreg.batch(pairs, tmp_path / "out", address=client, part_rows=4, read_attempts=1)
    rows = results(tmp_path / "out")
    assert len(rows) == report.rows == len(pairs)
    assert rows["status"].iloc[-1] in ("ok", "ambiguous", "low_confidence")
    for (_, status, error), row in zip(wrong, rows.itertuples(), strict=False):
        assert row.status == status
        assert error in row.error and "\n" not in row.error
        assert row.T_target_source is None and np.isnan(row.confidence)


def test_the_other_cloud_can_be_to_blame(
    client: Client, clouds: list[Path], tmp_path: Path
) -> None:
    vnreg.batch([(str(clouds[0]), np.zeros((5, 3)))], tmp_path, address=client)
    assert results(tmp_path)["error"][0] == "target: expected at least 24 points, found 5"


def test_options_reach_the_engine(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    hole = np.vstack([np.load(clouds[0]), [[np.nan] * 3]])
    pairs = [(hole, str(clouds[1]))]
    options = {"mode": "coarse", "max_points": 100, "seed": 5, "drop_non_finite": True}
    vnreg.batch(pairs, tmp_path, address=client, **options)
    (row,) = results(tmp_path).itertuples()
    result = vnreg.align(hole, np.load(clouds[1]), **options)
    np.testing.assert_array_equal(row.T_target_source, result.T_target_source.ravel())
    assert row.points_source == 100


def test_another_model(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    path = Path(__file__).resolve().parents[3] / "models/small.vnr"
    pairs = pairs_of(clouds, 2)
    vnreg.batch(pairs, tmp_path, address=client, mode="paper", model=path)
    expected = vnreg.align(
        *map(vnreg.read_cloud, pairs[0]), model=vnreg.Model.load(path), mode="paper"
    )
    row = results(tmp_path).iloc[0]
    np.testing.assert_array_equal(row["T_target_source"], expected.T_target_source.ravel())


def test_errors_of_reading_that_pass_are_waited_for(client: Client, clouds: list[Path]) -> None:
    fsspec.register_implementation("flaky", FlakyFileSystem, clobber=True)
    for name in ("source", "target"):
        fsspec.filesystem("memory").pipe_file(f"/flaky/{name}.npy", clouds[0].read_bytes())
    pairs = [("flaky://flaky/source.npy", "flaky://flaky/target.npy")]
    vnreg.batch(pairs, "memory://three", address=client, read_attempts=3)
    assert _of_memory("three")["status"].tolist() != ["unreadable"]
    assert set(FlakyFileSystem.reads.values()) == {3}
    vnreg.batch(pairs, "memory://two", address=client, read_attempts=2)
    (row,) = _of_memory("two").itertuples()
    assert row.status == "unreadable"
    assert row.error.endswith(
        "source.npy: expected a file that can be read, found Connection timed out"
    )


def _of_memory(folder: str) -> pd.DataFrame:
    files = fsspec.filesystem("memory")
    parts = sorted(files.glob(f"/{folder}/*.parquet"))
    return pd.concat([pd.read_parquet(files.open(path)) for path in parts], ignore_index=True)


def test_urls_of_memory(client: Client, clouds: list[Path]) -> None:
    memory = fsspec.filesystem("memory")
    for path in clouds:
        memory.pipe_file(f"/in/{path.name}", path.read_bytes())
    pairs = [("memory://in/scan_00.npy", f"memory://in/{path.name}") for path in clouds]
    vnreg.batch(pairs, "memory://out", address=client, part_rows=5)
    rows = _of_memory("out")
    poses = [
        vnreg.align(vnreg.read_cloud(clouds[0]), vnreg.read_cloud(path)).T_target_source
        for path in clouds
    ]
    np.testing.assert_array_equal(np.stack(rows["T_target_source"]), np.reshape(poses, (-1, 16)))
    assert not [name for name in memory.ls("/out", detail=False) if name.endswith(".tmp")]
    again = vnreg.batch(pairs, "memory://out", address=client, part_rows=5)
    assert (again.parts, again.resumed_parts) == (0, 3)


@pytest.mark.parametrize("attempts", [0, -1])
def test_numbers_out_of_range(attempts: int, client: Client, tmp_path: Path) -> None:
    for option in ("part_rows", "read_attempts", "in_flight"):
        with pytest.raises(ValueError, match=f"{option}: expected 1 or more"):
            vnreg.batch([], tmp_path / option, address=client, **{option: attempts})
