"""What goes into a file comes out again, bit by bit, and equal content gives equal bytes."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import tiny_file
from file_builder import Draft, padded, string_entry, table_entry
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from vnreg_train.model_file import (
    MetadataValue,
    decode_model,
    encode_model,
    read_checksum,
    read_model,
    write_model,
)

Tensors = dict[str, NDArray[Any]]

NAMES = st.text(alphabet="abzABZ019._", min_size=1, max_size=12)
TEXTS = st.text(
    alphabet=st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=30
)
VALUES = st.one_of(
    st.integers(0, 2**64 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    st.booleans(),
    TEXTS,
)
METADATA = st.dictionaries(NAMES, VALUES, max_size=8)

ELEMENTS: dict[str, st.SearchStrategy[float]] = {
    "f4": st.floats(allow_nan=False, allow_infinity=False, width=32),
    "f8": st.floats(allow_nan=False, allow_infinity=False, width=64),
    "i4": st.integers(-(2**31), 2**31 - 1),
}


@st.composite
def arrays(draw: st.DrawFn) -> NDArray[Any]:
    """Finite arrays of every dtype, byte order, rank and memory layout."""
    dtype = draw(st.sampled_from(["<f4", ">f4", "<f8", ">f8", "<i4", ">i4"]))
    shape = draw(hnp.array_shapes(min_dims=1, max_dims=4, min_side=1, max_side=5))
    array: NDArray[Any] = draw(hnp.arrays(dtype, shape, elements=ELEMENTS[dtype[1:]]))
    layout = draw(st.sampled_from(["as it is", "transposed", "reversed", "every second"]))
    if layout == "transposed":
        return array.T
    if layout == "reversed":
        return array[::-1]
    if layout == "every second":
        return array[::2]
    return array


TENSORS = st.dictionaries(NAMES, arrays(), max_size=5)


def assert_equal_tensors(got: Tensors, expected: Tensors) -> None:
    assert list(got) == sorted(expected)
    for name, tensor in got.items():
        native = expected[name].astype(expected[name].dtype.newbyteorder("="))
        assert tensor.dtype == native.dtype
        assert tensor.shape == native.shape
        assert tensor.tobytes() == native.tobytes()  # bits, so that -0.0 is not 0.0


@settings(deadline=None)
@given(metadata=METADATA, tensors=TENSORS)
def test_round_trip_gives_equal_types_values_and_bits(
    metadata: dict[str, MetadataValue], tensors: Tensors
) -> None:
    got_metadata, got_tensors = decode_model(encode_model(metadata, tensors))
    assert list(got_metadata) == sorted(metadata)
    for key, value in got_metadata.items():
        assert type(value) is type(metadata[key])
        assert repr(value) == repr(metadata[key])  # repr, so that -0.0 is not 0.0
    assert_equal_tensors(got_tensors, tensors)


@settings(deadline=None)
@given(metadata=METADATA, tensors=TENSORS, seed=st.integers(0, 1000))
def test_the_order_of_insertion_does_not_show(
    metadata: dict[str, MetadataValue], tensors: Tensors, seed: int
) -> None:
    generator = random.Random(seed)
    keys, names = list(metadata), list(tensors)
    generator.shuffle(keys)
    generator.shuffle(names)
    shuffled = encode_model({k: metadata[k] for k in keys}, {n: tensors[n] for n in names})
    assert shuffled == encode_model(metadata, tensors)


@settings(deadline=None)
@given(metadata=METADATA, tensors=TENSORS)
def test_a_second_export_is_byte_equal(
    metadata: dict[str, MetadataValue], tensors: Tensors
) -> None:
    content = encode_model(metadata, tensors)
    assert encode_model(*decode_model(content)) == content


def test_the_writer_gives_the_bytes_of_the_specification() -> None:
    tensors = {
        "b": np.array([[1, 2]], dtype=np.int32),
        "a": np.arange(17, dtype=np.float32),
    }
    expected = Draft(
        metadata=string_entry(b"arch", "naïve".encode()),
        table=table_entry(b"a", 1, (17,), 0) + table_entry(b"b", 3, (1, 2), 128),
        tensor_count=2,
        data=padded(tensors["a"].tobytes()) + padded(tensors["b"].tobytes()),
    )
    assert encode_model({"arch": "naïve"}, tensors) == expected.build()


def test_an_empty_file_has_a_header_only() -> None:
    content = encode_model({}, {})
    assert len(content) == 64
    assert decode_model(content) == ({}, {})


def test_numpy_scalars_are_written_as_their_values() -> None:
    metadata = {"i": np.int32(7), "f": np.float32(0.25), "b": np.bool_(True), "s": np.str_("x")}
    expected: dict[str, MetadataValue] = {"i": 7, "f": 0.25, "b": True, "s": "x"}
    content = encode_model(metadata, {})  # type: ignore[arg-type]  # metadata of any kind
    assert content == encode_model(expected, {})


def test_what_is_read_is_owned_and_writable(tmp_path: Path) -> None:
    path = tmp_path / "model.vnr"
    write_model(path, {}, {"a": np.zeros(4, np.float32)})
    _, tensors = read_model(path)
    tensors["a"][0] = 1
    _, again = read_model(path)
    assert again["a"].tolist() == [0, 0, 0, 0]


def test_the_tiny_file_is_written_again_byte_by_byte(tmp_path: Path) -> None:
    path = tmp_path / "tiny.vnr"
    write_model(path, tiny_file.METADATA, tiny_file.tensors())
    assert path.read_bytes() == tiny_file.PATH.read_bytes()
    assert path.stat().st_size < 10_000
    assert read_checksum(path) == int.from_bytes(path.read_bytes()[60:64], "little")


def test_the_tiny_file_holds_what_the_script_says() -> None:
    metadata, tensors = read_model(tiny_file.PATH)
    assert metadata == tiny_file.METADATA
    assert_equal_tensors(tensors, tiny_file.tensors())
