"""What the writer refuses, and that a failed write leaves nothing behind."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vnreg_train.model_file import ModelFileError, encode_model, read_model, write_model

GOOD = np.zeros(3, np.float32)


@pytest.mark.parametrize("name", ["", "x" * 129, "a b", "a/b", "a-b", "a\n", "a\0", "é", "a\u0661"])
def test_a_name_that_the_reader_refuses_is_not_written(name: str) -> None:
    with pytest.raises(ModelFileError, match="tensor name"):
        encode_model({}, {name: GOOD})
    with pytest.raises(ModelFileError, match="metadata key"):
        encode_model({name: 1}, {})


def test_the_longest_name_is_written() -> None:
    encode_model({"k" * 128: 1}, {"n" * 128: GOOD})


@pytest.mark.parametrize(
    "value",
    [
        -1,
        2**64,
        math.nan,
        math.inf,
        np.float32(np.inf),
        np.longdouble("1e400"),
        "\ud800",
        "a\0b",
        None,
        b"x",
        [1],
        1j,
        np.zeros(1),
    ],
    ids=repr,
)
def test_a_value_that_the_format_cannot_hold_is_not_written(value: Any) -> None:
    with pytest.raises(ModelFileError, match='metadata "k"'):
        encode_model({"k": value}, {})


@pytest.mark.parametrize("dtype", ["f2", "i8", "i2", "u4", "u1", "?", "c8", "O", "S4", "f4,f4"])
def test_no_dtype_is_converted_on_the_way(dtype: str) -> None:
    with pytest.raises(ModelFileError, match='tensor "t" dtype'):
        encode_model({}, {"t": np.zeros(2, dtype)})


@pytest.mark.parametrize("shape", [(), (1, 1, 1, 1, 1)])
def test_a_rank_that_is_not_1_to_4_is_not_written(shape: tuple[int, ...]) -> None:
    with pytest.raises(ModelFileError, match='tensor "t" rank'):
        encode_model({}, {"t": np.zeros(shape, np.float32)})


@pytest.mark.parametrize("shape", [(0,), (3, 0), (0, 2, 2)])
def test_an_empty_tensor_is_not_written(shape: tuple[int, ...]) -> None:
    with pytest.raises(ModelFileError, match='tensor "t" shape'):
        encode_model({}, {"t": np.zeros(shape, np.float32)})


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("dtype", ["<f4", ">f4", "<f8", ">f8"])
def test_a_weight_that_is_not_finite_is_not_written(value: float, dtype: str) -> None:
    weights = np.zeros((2, 3), dtype)
    weights[1, 1] = value
    with pytest.raises(ModelFileError, match='tensor "t" element 4'):
        encode_model({}, {"t": weights})


def test_a_list_is_not_a_tensor() -> None:
    with pytest.raises(ModelFileError, match="a numpy array"):
        encode_model({}, {"t": [1.0]})  # type: ignore[dict-item]  # refused is what is tested


def test_too_much_metadata_is_not_written() -> None:
    with pytest.raises(ModelFileError, match="metadata bytes"):
        encode_model({"k": "x" * 2**20}, {})


def test_too_many_tensors_are_not_written() -> None:
    with pytest.raises(ModelFileError, match="tensor count"):
        encode_model({}, {str(i): GOOD for i in range(65537)})


def write_old(folder: Path) -> Path:
    path = folder / "model.vnr"
    write_model(path, {"name": "old"}, {"w": GOOD})
    return path


def assert_only_old(path: Path) -> None:
    assert read_model(path)[0] == {"name": "old"}
    assert [entry.name for entry in path.parent.iterdir()] == ["model.vnr"]


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    path = write_old(tmp_path)
    write_model(path, {"name": "new"}, {"w": GOOD})
    assert read_model(path)[0] == {"name": "new"}
    assert [entry.name for entry in tmp_path.iterdir()] == ["model.vnr"]


def test_refused_content_leaves_the_old_file(tmp_path: Path) -> None:
    path = write_old(tmp_path)
    with pytest.raises(ModelFileError):
        write_model(path, {"name": "new"}, {"w": np.array([np.nan], np.float32)})
    assert_only_old(path)


def test_a_disk_that_fails_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(descriptor: int) -> None:
        raise OSError("no space")

    path = write_old(tmp_path)
    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="no space"):
        write_model(path, {"name": "new"}, {"w": GOOD})
    assert_only_old(path)


def test_a_disk_that_returns_other_bytes_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_old(tmp_path)
    honest = Path.read_bytes
    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", lambda file: honest(file)[:-1] + b"\x01")
        with pytest.raises(ModelFileError, match="file read back"):
            write_model(path, {"name": "new"}, {"w": GOOD})
    assert_only_old(path)


def test_a_directory_is_not_replaced(tmp_path: Path) -> None:
    target = tmp_path / "model.vnr"
    target.mkdir()
    with pytest.raises(OSError, match="directory"):
        write_model(target, {}, {"w": GOOD})
    assert target.is_dir()
    assert [entry.name for entry in tmp_path.iterdir()] == ["model.vnr"]


def test_a_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_model(tmp_path / "absent" / "model.vnr", {}, {"w": GOOD})


def test_the_file_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    path = write_old(tmp_path)
    other = tmp_path / "other"
    other.touch()
    assert path.stat().st_mode == other.stat().st_mode
