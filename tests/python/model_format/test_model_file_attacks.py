"""Attacks on the reader, one test each, named after the attack."""

from __future__ import annotations

import dataclasses
import math
import os
import random
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
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
    f64_entry,
    one_tensor,
    small_draft,
    string_entry,
    table_entry,
    two_tensors,
    u64_entry,
    with_metadata,
)

from vnreg_train.model_file import (
    ModelFileError,
    decode_model,
    encode_model,
    read_checksum,
    read_model,
)

PATTERNS = [1, 2, 4, 8, 16, 32, 64, 128, 0x55, 0xAA, 0x7F, 0xFF]


def refusal(content: bytes, field: str) -> ModelFileError:
    """The refusal of `content`; checks that it is about `field` and says both values."""
    with pytest.raises(ModelFileError) as caught:
        decode_model(content)
    error = caught.value
    assert field in error.field
    assert error.expected and error.got and error.expected != error.got
    return error


def test_the_undamaged_file_is_read() -> None:
    metadata, tensors = decode_model(small_draft().build())
    assert metadata == {
        "arch": "paper",
        "input.rms_radius": 0.5,
        "neighbours": 20,
        "relu.shared_direction": True,
    }
    assert tensors["a.weight"].dtype == np.float32
    expected = np.array([[1, -2, 3.5], [0, -0.0, 1e-40]], np.float32)
    assert tensors["a.weight"].tobytes() == expected.tobytes()
    assert tensors["b"].tolist() == [[[[-2, -1, 0, 1, 2]]]]
    assert tensors["b"].dtype == np.int32
    assert tensors["c"].tolist() == [0.1 * i for i in range(9)]


def test_every_single_changed_byte_is_refused() -> None:
    content = small_draft().build()
    for position in range(len(content)):
        for pattern in PATTERNS:
            damaged = bytearray(content)
            damaged[position] ^= pattern
            with pytest.raises(ModelFileError):
                decode_model(bytes(damaged))


def test_a_changed_byte_under_repaired_checksums_is_refused_or_means_something() -> None:
    content = small_draft().build()
    accepted = 0
    for position in range(8, 60):
        accepted += accepted_and_canonical(content, position, 1 + position % 255)
    for position in range(64, len(content)):
        for pattern in (1, 0x20, 0x80):
            accepted += accepted_and_canonical(content, position, pattern)
    assert accepted > 100


def accepted_and_canonical(content: bytes, position: int, pattern: int) -> bool:
    """Whether the damaged content is accepted; if so, the writer must write it again as it is."""
    damaged = bytearray(content)
    damaged[position] ^= pattern
    (offset,) = struct.unpack_from("<Q", damaged, 40)
    if 64 <= offset <= len(damaged):
        damaged[56:60] = struct.pack("<I", crc32c(bytes(damaged[offset:])))
        damaged[60:64] = struct.pack("<I", crc32c(bytes(damaged[:60] + damaged[64:offset])))
    try:
        decoded = decode_model(bytes(damaged))
    except ModelFileError:
        return False
    if not 12 <= position < 16:  # the minor version is free
        assert encode_model(*decoded) == bytes(damaged)
    return True


def test_random_bytes_are_refused() -> None:
    generator = random.Random(1)
    content = small_draft().build()
    for _ in range(300):
        tail = generator.randbytes(generator.randrange(200))
        for noise in (tail, content[:8] + tail, content[:16] + tail, content[:64] + tail):
            with pytest.raises(ModelFileError):
                decode_model(noise)


def test_a_file_cut_at_any_length_is_refused() -> None:
    content = small_draft().build()
    for size in range(len(content)):
        field = "magic" if size < 8 else "header" if size < 64 else "file size"
        refusal(content[:size], field)


@pytest.mark.parametrize("size", [1, 63, 64, 4096])
def test_a_longer_file_is_refused(size: int) -> None:
    refusal(small_draft().build() + bytes(size), "file size")


@pytest.mark.parametrize(
    "transfer",
    [
        lambda content: content.replace(b"\r\n", b"\n"),
        lambda content: content.replace(b"\n", b"\r\n"),
        lambda content: content.replace(b"\r", b"\n"),
        lambda content: bytes(byte & 0x7F for byte in content),
    ],
    ids=["crlf-to-lf", "lf-to-crlf", "cr-to-lf", "seven-bits"],
)
def test_a_transfer_as_text_is_refused_and_named(transfer: Callable[[bytes], bytes]) -> None:
    assert "transfer as text" in refusal(transfer(small_draft().build()), "magic").got


def test_a_transfer_as_utf8_is_refused() -> None:
    refusal(small_draft().build().decode("latin-1").encode("utf-8"), "magic")


def test_a_file_cut_at_the_end_of_file_character_is_refused() -> None:
    content = small_draft().build()
    refusal(content[: content.index(0x1A)], "magic")


def test_a_newer_major_version_is_refused_and_both_are_named() -> None:
    error = refusal(dataclasses.replace(small_draft(), major=2, minor=7).build(), "major version")
    assert "1.0" in error.expected
    assert "2.7" in error.got


def test_the_version_is_judged_before_fields_that_a_newer_version_may_redefine() -> None:
    refusal(Draft().magic + struct.pack("<II", 2, 0) + b"\xff" * 48, "major version")


def test_major_version_zero_is_refused() -> None:
    refusal(dataclasses.replace(small_draft(), major=0).build(), "major version")


@pytest.mark.parametrize("minor", [1, 2**32 - 1])
def test_a_newer_minor_version_is_read(minor: int) -> None:
    newer = decode_model(dataclasses.replace(small_draft(), minor=minor).build())
    assert encode_model(*newer) == small_draft().build()


@pytest.mark.parametrize("error", [1, 0x80000000])
def test_wrong_checksums_are_refused(error: int) -> None:
    head = dataclasses.replace(small_draft(), head_checksum_error=error)
    data = dataclasses.replace(small_draft(), data_checksum_error=error)
    refusal(head.build(), "head checksum (byte 60)")
    refusal(data.build(), "data checksum (byte 56)")


@pytest.mark.parametrize(
    ("field", "value", "named"),
    [
        ("file_size", 0, "file size (byte 16)"),
        ("file_size", 2**30 + 1, "file size (byte 16)"),
        ("file_size", HUGE, "file size (byte 16)"),
        ("metadata_bytes", 2**20 + 1, "metadata bytes (byte 24)"),
        ("metadata_bytes", HUGE, "metadata bytes (byte 24)"),
        ("metadata_bytes", HUGE - 63, "metadata bytes (byte 24)"),
        ("metadata_bytes", 2**20, "data offset (byte 40)"),
        ("metadata_bytes", 0, 'tensor "arch" dtype'),
        ("tensor_count", 65537, "tensor count (byte 32)"),
        ("tensor_count", HUGE, "tensor count (byte 32)"),
        ("tensor_count", 65536, "name of tensor 3"),
        ("tensor_count", 4, "name of tensor 3"),
        ("tensor_count", 2, "padding after the tensor table"),
        ("tensor_count", 0, "data offset (byte 40)"),
        ("data_offset", 0, "data offset (byte 40)"),
        ("data_offset", 64, "data offset (byte 40)"),
        ("data_offset", 321, "data offset (byte 40)"),
        ("data_offset", 4096, "data offset (byte 40)"),
        ("data_offset", HUGE - 63, "data offset (byte 40)"),
        ("data_bytes", 0, "data bytes (byte 48)"),
        ("data_bytes", 192, "data bytes (byte 48)"),
        ("data_bytes", HUGE, "data bytes (byte 48)"),
    ],
)
def test_a_header_field_that_lies_is_refused(field: str, value: int, named: str) -> None:
    draft = small_draft()
    setattr(draft, field, value)
    refusal(draft.build(), named)


def test_a_data_offset_that_skips_a_block_of_zeros_is_refused() -> None:
    draft = small_draft()
    head = draft.metadata + draft.table
    draft.table_padding = bytes(-len(head) % 64 + 64)
    refusal(draft.build(), "data offset (byte 40)")


def test_data_that_belongs_to_no_tensor_is_refused() -> None:
    draft = small_draft()
    draft.data += bytes(64)
    refusal(draft.build(), "data bytes (byte 48)")


def test_bytes_after_the_data_are_refused_even_where_the_file_size_counts_them() -> None:
    draft = small_draft()
    draft.data_bytes = len(draft.data)
    draft.data += bytes(64)
    refusal(draft.build(), "data bytes (byte 48)")


def test_data_without_its_last_padding_is_refused() -> None:
    draft = small_draft()
    draft.data = draft.data[: 128 + 72]
    refusal(draft.build(), 'tensor "c" padded size')


def test_overlapping_tensors_are_refused() -> None:
    refusal(two_tensors(b"a", b"b", (0, 0)), 'tensor "b" offset')


def test_swapped_offsets_are_refused() -> None:
    refusal(two_tensors(b"a", b"b", (64, 0)), 'tensor "a" offset')


@pytest.mark.parametrize("offset", [4, 12, 63, 65, 128, HUGE, HUGE - 63])
def test_unaligned_and_far_offsets_are_refused(offset: int) -> None:
    refusal(two_tensors(b"a", b"b", (0, offset)), 'tensor "b" offset')
    refusal(two_tensors(b"a", b"b", (offset, 64)), 'tensor "a" offset')


def test_duplicate_tensors_are_refused() -> None:
    refusal(two_tensors(b"a", b"a"), "name of tensor 1")


@pytest.mark.parametrize("names", [(b"b", b"a"), (b"a.10", b"a.1"), (b"a", b"B")])
def test_unsorted_tensors_are_refused(names: tuple[bytes, bytes]) -> None:
    refusal(two_tensors(*names), "name of tensor 1")


@pytest.mark.parametrize("name", [b"", b"x" * 129, b"a b", b"../a", b"a\n", b"a\0", b"\xc3\xa9"])
def test_names_outside_the_alphabet_or_the_length_are_refused(name: bytes) -> None:
    refusal(two_tensors(name, b"zz"), "name of tensor 0")
    refusal(with_metadata(u64_entry(name, 1)), "metadata key 0")


@pytest.mark.parametrize("rank", [0, 5, 6, 1000])
def test_a_rank_that_is_not_1_to_4_is_refused(rank: int) -> None:
    refusal(one_tensor((1,) * rank), 'tensor "w" rank')


def test_a_huge_rank_is_refused_before_the_shape_is_read() -> None:
    table = counted(b"w") + struct.pack("<IIQ", F32, 2**32 - 1, 0)
    refusal(Draft(table=table, tensor_count=1, data=bytes(64)).build(), 'tensor "w" rank')


@pytest.mark.parametrize("dtype", [0, 4, 0x101, 2**32 - 1])
def test_an_unknown_dtype_is_refused(dtype: int) -> None:
    refusal(one_tensor((1,), dtype), 'tensor "w" dtype')


@pytest.mark.parametrize("shape", [(0,), (0, 1), (1, 0), (3, 0, 2), (1, 1, 1, 0), (HUGE, 0)])
def test_a_zero_extent_is_refused(shape: tuple[int, ...]) -> None:
    refusal(one_tensor(shape), 'tensor "w" extent of axis')


@pytest.mark.parametrize(
    "shape",
    WRAPPING_SHAPES,
)
@pytest.mark.parametrize("dtype", [F32, F64_TENSOR, I32])
def test_a_shape_larger_than_the_data_is_refused(shape: tuple[int, ...], dtype: int) -> None:
    refusal(one_tensor(shape, dtype), 'tensor "w" ')


@pytest.mark.parametrize("bits", [0x7F800000, 0xFF800000, 0x7FC00000, 0xFFC00000, 0x7F800001])
@pytest.mark.parametrize("index", [0, 7, 15])
def test_nan_and_infinity_in_f32_are_refused(bits: int, index: int) -> None:
    data = bytearray(64)
    data[4 * index : 4 * index + 4] = struct.pack("<I", bits)
    refusal(one_tensor((16,), F32, bytes(data)), f'tensor "w" element {index}')
    assert decode_model(one_tensor((16,), I32, bytes(data)))[1]["w"].view(np.uint32)[index] == bits


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_nan_and_infinity_in_f64_are_refused(value: float) -> None:
    data = bytes(24) + struct.pack("<d", value) + bytes(32)
    refusal(one_tensor((2, 4), F64_TENSOR, data), 'tensor "w" element 3')


def test_nonzero_padding_after_the_table_is_refused() -> None:
    draft = Draft(table=table_entry(b"w", F32, (1,), 0), tensor_count=1, data=bytes(64))
    room = -len(draft.table) % 64
    for position in range(room):
        draft.table_padding = bytes(position) + b"\x01" + bytes(room - position - 1)
        error = refusal(draft.build(), "padding after the tensor table")
        assert f"(byte {64 + len(draft.table) + position})" in error.field


def test_nonzero_padding_after_a_tensor_is_refused() -> None:
    for position in range(12, 64):
        data = bytes(position) + b"\x80" + bytes(63 - position)
        error = refusal(one_tensor((3,), F32, data), 'padding after tensor "w"')
        assert f"(byte {128 + position})" in error.field


@pytest.mark.parametrize("keys", [(b"a", b"a"), (b"b", b"a"), (b"a.b", b"a"), (b"a", b"Z")])
def test_duplicate_and_unsorted_keys_are_refused(keys: tuple[bytes, bytes]) -> None:
    refusal(with_metadata(u64_entry(keys[0], 1) + u64_entry(keys[1], 1)), "metadata key 1")


@pytest.mark.parametrize("kind", [0, 5, 0x101, 2**32 - 1])
def test_an_unknown_type_is_refused(kind: int) -> None:
    refusal(with_metadata(entry(b"k", kind, bytes(8))), 'metadata "k" type')


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_refused(value: float) -> None:
    refusal(with_metadata(f64_entry(b"k", value)), 'metadata "k"')


@pytest.mark.parametrize("value", [2, 0x80, 0xFF])
def test_a_non_canonical_bool_is_refused(value: int) -> None:
    refusal(with_metadata(bool_entry(b"k", value)), 'metadata "k"')


@pytest.mark.parametrize(
    "text",
    [
        b"\xff",
        b"abc\x80",
        b"\xc3",
        b"\xc0\xaf",  # overlong
        b"\xe0\x80\xaf",  # overlong
        b"\xed\xa0\x80",  # surrogate
        b"\xf4\x90\x80\x80",  # past U+10FFFF
        b"\xf8\x88\x80\x80\x80",
        b"a\0b",  # cuts a C string
    ],
)
def test_text_that_is_not_utf8_is_refused(text: bytes) -> None:
    refusal(with_metadata(string_entry(b"k", text)), 'metadata "k"')


def test_text_cannot_borrow_its_last_byte_from_the_next_entry() -> None:
    error = refusal(with_metadata(string_entry(b"a", b"\xc3") + b"\xa9"), 'metadata "a"')
    assert "(byte 77)" in error.field


@pytest.mark.parametrize("length", [2, 64, 2**31, 2**32 - 1])
def test_text_that_runs_over_the_end_is_refused(length: int) -> None:
    refusal(with_metadata(entry(b"k", 4, struct.pack("<I", length) + b"x")), 'metadata "k"')


def test_metadata_cut_at_any_byte_is_refused() -> None:
    first = u64_entry(b"a", 1)
    whole = first + string_entry(b"b", b"text")
    for size in range(1, len(whole)):
        if size != len(first):
            refusal(with_metadata(whole[:size]), "metadata")


def test_one_mebibyte_of_metadata_is_read_and_a_byte_more_refused() -> None:
    room = 2**20 - len(string_entry(b"k", b""))
    metadata, _ = decode_model(with_metadata(string_entry(b"k", b"x" * room)))
    assert metadata == {"k": "x" * room}
    refusal(with_metadata(string_entry(b"k", b"x" * (room + 1))), "metadata bytes")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_model(tmp_path / "absent.vnr")


def test_a_directory_is_refused(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        read_model(tmp_path)


def test_an_empty_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty").touch()
    with pytest.raises(ModelFileError, match="an empty file"):
        read_model(tmp_path / "empty")


def test_a_pipe_is_refused_without_waiting_for_its_writer(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ModelFileError, match="a regular file"):
        read_model(tmp_path / "pipe")


def test_a_file_over_one_gibibyte_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "sparse"
    path.write_bytes(small_draft().build())
    os.truncate(path, 2**30 + 1)
    with pytest.raises(ModelFileError, match=f"expected at most {2**30} bytes"):
        read_model(path)


def test_the_checksum_of_a_damaged_file_is_not_given(tmp_path: Path) -> None:
    content = small_draft().build()
    path = tmp_path / "model.vnr"
    path.write_bytes(content)
    assert read_checksum(path) == int.from_bytes(content[60:64], "little")
    path.write_bytes(content[:-1] + b"\x01")
    with pytest.raises(ModelFileError):
        read_checksum(path)
