"""The two readers, C++ and Python: every attack is refused by both, with the same words."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiny_file
from file_builder import (
    F32,
    F64_TENSOR,
    HUGE,
    I32,
    WRAPPING_SHAPES,
    Draft,
    bool_entry,
    counted,
    crc32c,
    entry,
    one_tensor,
    small_draft,
    string_entry,
    table_entry,
    two_tensors,
    u64_entry,
    with_metadata,
)
from hypothesis import given, settings
from hypothesis import strategies as st

import vnreg
from vnreg_train.export.architecture import check_architecture
from vnreg_train.model_file import (
    MetadataValue,
    ModelFileError,
    decode_model,
    encode_model,
    read_model,
)

MODELS = Path(__file__).parents[3] / "models"
Metadata = dict[str, MetadataValue]
Tensors = dict[str, Any]


def cpp_refusal(content: bytes) -> str | None:
    """What the engine says of the file; None where it takes it."""
    try:
        vnreg.Model.from_bytes(content)
    except vnreg.Error as error:
        return str(error)
    return None


def python_refusal(content: bytes) -> str | None:
    try:
        check_architecture(*decode_model(content))
    except ModelFileError as error:
        return str(error)
    return None


def check_refused_alike(content: bytes, about: str = "") -> None:
    said = cpp_refusal(content)
    assert said is not None
    assert python_refusal(content) == said
    assert about in said
    assert said.isprintable() and len(said) < 500, "one line that a terminal can show"


# ---- the container ----


def header_attacks() -> Iterator[tuple[str, bytes]]:
    good = small_draft()
    yield "an empty file", b""
    yield "bad magic", b"\x7fELF" + good.build()[4:]
    yield "magic of a transfer as text", good.build().replace(b"\r\n", b"\n")
    yield "newer major version", replace(good, major=2, minor=7).build()
    yield "major version 0", replace(good, major=0).build()
    yield "largest major version", replace(good, major=2**32 - 1).build()
    yield "trailing byte", good.build() + b"\0"
    yield "trailing block", good.build() + bytes(64)
    for field in ("file_size", "metadata_bytes", "tensor_count", "data_offset", "data_bytes"):
        right = struct.unpack_from("<Q", good.build(), 16 + 8 * HEADER_FIELDS.index(field))[0]
        for value in (0, 1, 63, right - 1, right + 1, right + 64, 2**20 + 1, 2**30 + 1):
            yield f"{field} {value}", draft_with(field, value)
        for value in (2**31, 2**32 - 1, 2**32, 2**32 + right, 2**63, HUGE - 63, HUGE):
            yield f"{field} {value}", draft_with(field, value)
    yield "wrong head checksum", replace(good, head_checksum_error=1).build()
    yield "wrong data checksum", replace(good, data_checksum_error=1).build()
    yield "data of no tensor", replace(good, data=good.data + bytes(64)).build()
    yield "data without the last padding", replace(good, data=good.data[:200]).build()
    gap = bytes(-len(good.metadata + good.table) % 64 + 64)
    yield "a block of zeros after the table", replace(good, table_padding=gap).build()


HEADER_FIELDS = ("file_size", "metadata_bytes", "tensor_count", "data_offset", "data_bytes")


def draft_with(field: str, value: int) -> bytes:
    draft = small_draft()
    setattr(draft, field, value)
    return draft.build()


def metadata_attacks() -> Iterator[tuple[str, bytes]]:
    for keys in ((b"a", b"a"), (b"b", b"a"), (b"a", b"Z")):
        metadata = u64_entry(keys[0], 1) + u64_entry(keys[1], 1)
        yield f"keys {keys[0]!r}, {keys[1]!r}", with_metadata(metadata)
    for key in (b"", b"x" * 129, b"a b", b"../a", b"a\n", b"a\0", b"\xc3\xa9", b"\x1b[31m"):
        yield f"key {key[:9]!r}", with_metadata(u64_entry(key, 1))
    for length in (2**31, 2**32 - 1):
        yield f"key of length {length}", with_metadata(struct.pack("<I", length) + b"k")
    for kind in (0, 5, 0x101, 2**32 - 1):
        yield f"type {kind}", with_metadata(entry(b"k", kind, bytes(8)))
    for bits in (0x7FF0 << 48, 0xFFF0 << 48, 0x7FF8 << 48, 0xFFF8 << 48, (0x7FF0 << 48) + 1):
        yield f"f64 {bits:x}", with_metadata(entry(b"k", 2, struct.pack("<Q", bits)))
    for flag in (2, 0x80, 0xFF):
        yield f"bool {flag}", with_metadata(bool_entry(b"k", flag))
    for text in BAD_TEXTS:
        yield f"text {text!r}", with_metadata(string_entry(b"k", text))
    for length in (2, 64, 2**31, 2**32 - 1):
        value = struct.pack("<I", length) + b"x"
        yield f"text of length {length}", with_metadata(entry(b"k", 4, value))
    whole = u64_entry(b"a", 1) + string_entry(b"b", b"text")
    for size in set(range(1, len(whole))) - {len(u64_entry(b"a", 1))}:
        yield f"metadata cut at {size}", with_metadata(whole[:size])
    room = 2**20 + 1 - len(string_entry(b"k", b""))
    yield "1 MiB and a byte of metadata", with_metadata(string_entry(b"k", b"x" * room))


BAD_TEXTS = [
    b"\xff",
    b"abc\x80",
    b"\xc3",
    b"\xc0\xaf",
    b"\xe0\x80\xaf",
    b"\xe2\x82",
    b"\xed\xa0\x80",
    b"\xf0\x8f\xbf\xbf",
    b"\xf4\x90\x80\x80",
    b"\xf8\x88\x80\x80\x80",
    b"a\0b",
    b"a\0\xff",
    b"\xff\0",
]


def table_attacks() -> Iterator[tuple[str, bytes]]:
    yield "overlapping tensors", two_tensors(b"a", b"b", (0, 0))
    yield "swapped offsets", two_tensors(b"a", b"b", (64, 0))
    for offset in (4, 12, 63, 65, 128, 2**32, HUGE - 63, HUGE):
        yield f"second offset {offset}", two_tensors(b"a", b"b", (0, offset))
        yield f"first offset {offset}", two_tensors(b"a", b"b", (offset, 64))
    for names in ((b"a", b"a"), (b"b", b"a"), (b"a.10", b"a.1"), (b"a", b"B")):
        yield f"names {names[0]!r}, {names[1]!r}", two_tensors(*names)
    for name in (b"", b"x" * 129, b"a b", b"../a", b"a\n", b"a\0", b"\xc3\xa9"):
        yield f"name {name[:9]!r}", two_tensors(name, b"zz")
    for rank in (0, 5, 1000):
        yield f"rank {rank}", one_tensor((1,) * rank)
    entry_start = counted(b"w") + struct.pack("<I", F32)
    for rank in (4, 2**31, 2**32 - 1):
        table = entry_start + struct.pack("<IQ", rank, 1)
        draft = Draft(table=table, tensor_count=1, data=bytes(64), table_padding=b"")
        draft.table += bytes(-len(table) % 64) if rank != 4 else b""
        yield f"rank {rank} of a short entry", draft.build()
    for dtype in (0, 4, 0x101, 2**32 - 1):
        yield f"dtype {dtype}", one_tensor((1,), dtype)
    for shape in ((0,), (0, 1), (1, 0), (3, 0, 2), (1, 1, 1, 0), (HUGE, 0), (0, HUGE)):
        yield f"shape {shape}", one_tensor(shape)
    for dtype in (F32, F64_TENSOR, I32):
        for shape in WRAPPING_SHAPES:
            yield f"dtype {dtype}, shape {shape}", one_tensor(shape, dtype)


def data_attacks() -> Iterator[tuple[str, bytes]]:
    for bits in (0x7F800000, 0xFF800000, 0x7FC00000, 0xFFC00000, 0x7F800001):
        data = bytearray(64)
        data[28:32] = struct.pack("<I", bits)
        yield f"f32 weight {bits:x}", one_tensor((16,), F32, bytes(data))
    for value in (math.nan, math.inf, -math.inf):
        data = bytearray(bytes(24) + struct.pack("<d", value) + bytes(32))
        yield f"f64 weight {value}", one_tensor((2, 4), F64_TENSOR, bytes(data))
    table = table_entry(b"w", F32, (1,), 0)
    for position in range(-len(table) % 64):
        padding = bytearray(-len(table) % 64)
        padding[position] = 1
        draft = Draft(table=table, tensor_count=1, data=bytes(64), table_padding=bytes(padding))
        yield f"table padding {position}", draft.build()
    for position in range(12, 64):
        data = bytearray(64)
        data[position] = 0x80
        yield f"tensor padding {position}", one_tensor((3,), F32, bytes(data))


CONTAINER_ATTACKS = [
    *header_attacks(),
    *metadata_attacks(),
    *table_attacks(),
    *data_attacks(),
]


@pytest.mark.parametrize(
    "content", [content for _, content in CONTAINER_ATTACKS], ids=[n for n, _ in CONTAINER_ATTACKS]
)
def test_container_attack(content: bytes) -> None:
    check_refused_alike(content)


def test_truncated_at_every_byte() -> None:
    content = small_draft().build()
    for size in range(len(content)):
        check_refused_alike(content[:size])


def test_a_flipped_bit_anywhere() -> None:
    content = tiny_file.PATH.read_bytes()
    for position in range(len(content)):
        damaged = bytearray(content)
        damaged[position] ^= 1 << position % 8
        check_refused_alike(bytes(damaged))


def repaired(content: bytes) -> bytes:
    """With the checksums that the bytes ask for, where the data offset allows."""
    fixed = bytearray(content)
    (offset,) = struct.unpack_from("<Q", fixed, 40)
    if 64 <= offset <= len(fixed):
        fixed[56:60] = struct.pack("<I", crc32c(bytes(fixed[offset:])))
        fixed[60:64] = struct.pack("<I", crc32c(bytes(fixed[:60] + fixed[64:offset])))
    return bytes(fixed)


def test_a_changed_byte_anywhere_under_repaired_checksums() -> None:
    content = small_draft().build()
    for position in range(len(content)):
        for pattern in (1, 0x20, 0x80, 0xFF):
            damaged = bytearray(content)
            damaged[position] ^= pattern
            check_refused_alike(repaired(bytes(damaged)))


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_spliced_bytes_under_repaired_checksums(data: st.DataObject) -> None:
    content = bytearray(small_draft().build())
    for _ in range(data.draw(st.integers(1, 4))):
        size = data.draw(st.integers(1, 8))
        to = data.draw(st.integers(8, len(content) - size))
        start = data.draw(st.integers(0, len(content) - size))
        fills = (bytes(size), b"\xff" * size, bytes(content[start : start + size]))
        content[to : to + size] = data.draw(st.sampled_from(fills))
    damaged = repaired(bytes(content))
    assert python_refusal(damaged) == cpp_refusal(damaged)


# ---- the architectures ----


@cache
def shipped(name: str) -> tuple[Metadata, Tensors]:
    return read_model(MODELS / f"{name}.vnr")


def check_model_refused(metadata: Metadata, tensors: Tensors, about: str) -> None:
    check_refused_alike(encode_model(metadata, tensors), about)


ARCHITECTURES = ["small", "vnreg"]
MAY_BE_MISSING = ("calibration.verified.covariance", "provenance.")


@pytest.mark.parametrize("name", ARCHITECTURES)
def test_the_shipped_models_are_taken_by_both(name: str) -> None:
    content = encode_model(*shipped(name))
    assert cpp_refusal(content) is None
    assert python_refusal(content) is None


@pytest.mark.parametrize("name", ARCHITECTURES)
def test_a_missing_key_and_a_key_of_another_type(name: str) -> None:
    metadata, tensors = shipped(name)
    for key, value in metadata.items():
        others: list[MetadataValue] = [7, 0.5, True, "text"]
        other = next(v for v in others if type(v) is not type(value))
        if key != "channels.judge":
            check_model_refused(metadata | {key: other}, tensors, key)
        rest = {k: v for k, v in metadata.items() if k != key}
        if key == "channels.judge":
            check_model_refused(rest, tensors, "judge.point.0.bias")
        elif not key.startswith(MAY_BE_MISSING):
            check_model_refused(rest, tensors, key)


@pytest.mark.parametrize("name", ARCHITECTURES)
def test_a_hyper_parameter_out_of_range(name: str) -> None:
    metadata, tensors = shipped(name)
    for key, value in metadata.items():
        wrong: list[MetadataValue] = []
        if key.startswith("calibration.") or isinstance(value, bool):
            continue
        if isinstance(value, int):
            wrong = [0, 2**32 - 1, 2**32 + value, 2**63, HUGE]
        elif isinstance(value, float):
            wrong = [-1.0, 1e-5, 1e4, 5e-324, 1.7976931348623157e308]
        if key == "fine.iterations":
            wrong = wrong[1:]  # 0: an untrained fine register
        for number in wrong:
            check_model_refused(metadata | {key: number}, tensors, key)


@pytest.mark.parametrize("name", ARCHITECTURES)
def test_hyper_parameters_that_do_not_match_the_shapes(name: str) -> None:
    metadata, tensors = shipped(name)
    for key, value in metadata.items():
        if key.startswith(("channels.", "blocks.")):
            step = 4 if key == "channels.local" else 1
            # Of these names the values are whole numbers.
            changed = value - step if key == "channels.product" else value + step  # type: ignore[operator]
            check_model_refused(metadata | {key: changed}, tensors, "tensor")
        elif isinstance(value, bool):
            check_model_refused(metadata | {key: not value}, tensors, "tensor")


@pytest.mark.parametrize("arch", ["golden", "", "Paper", "\x1b]0;pwned\x07", "x" * 100_000])
def test_another_architecture_is_not_echoed(arch: str) -> None:
    metadata, tensors = shipped("small")
    check_model_refused(metadata | {"arch": arch}, tensors, "expected paper or vnreg")


@pytest.mark.parametrize("name", ["", "n" * 65, "é" * 33])
def test_a_name_of_a_wrong_length(name: str) -> None:
    metadata, tensors = shipped("small")
    check_model_refused(metadata | {"name": name}, tensors, '"name"')


def test_long_provenance() -> None:
    metadata, tensors = shipped("small")
    check_model_refused(metadata | {"provenance.x": "é" * 2049}, tensors, "provenance.x")


@pytest.mark.parametrize("name", ARCHITECTURES)
def test_missing_renamed_extra_and_wrongly_shaped_tensors(name: str) -> None:
    metadata, tensors = shipped(name)
    for key, tensor in list(tensors.items())[::3]:
        rest = {k: v for k, v in tensors.items() if k != key}
        check_model_refused(metadata, rest, key)
        check_model_refused(metadata, rest | {key + "x": tensor}, key)
        check_model_refused(metadata, tensors | {key + "x": tensor}, key + "x")
        check_model_refused(metadata, tensors | {key: tensor.reshape(-1, 1, 1)}, key)
        check_model_refused(metadata, tensors | {key: tensor[..., None]}, key)
        check_model_refused(metadata, tensors | {key: tensor.astype(np.float64)}, "dtype")
        longer = np.concatenate([tensor, tensor])
        check_model_refused(metadata, tensors | {key: longer}, f'"{key}" shape')


def test_of_two_wrong_tensors_the_same_is_named() -> None:
    """Found by this test: arguments of one call were read in an order that the compiler chose."""
    metadata, tensors = shipped("small")
    names = [*tensors]
    for first, second in zip(names, names[1:], strict=False):
        rest = {k: v for k, v in tensors.items() if k not in (first, second)}
        check_model_refused(metadata, rest, "nothing")
