"""Builds model files byte by byte from model_format/SPEC.md, right or wrong on purpose.

It shares no code with the writer or the reader. Every field can be overridden while the checksums
stay right, so that a test reaches the check behind them.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

U64, F64, BOOL, STRING = 1, 2, 3, 4
F32, F64_TENSOR, I32 = 1, 2, 3


def _table_of_bytes() -> list[int]:
    table = []
    for byte in range(256):
        for _ in range(8):
            byte = (byte >> 1) ^ (0x82F63B78 if byte & 1 else 0)
        table.append(byte)
    return table


_TABLE = _table_of_bytes()


def crc32c(content: bytes) -> int:
    """CRC32C by its definition, a byte at a time."""
    state = 0xFFFFFFFF
    for byte in content:
        state = (state >> 8) ^ _TABLE[(state ^ byte) & 0xFF]
    return state ^ 0xFFFFFFFF


def padded(content: bytes) -> bytes:
    return content + bytes(-len(content) % 64)


def counted(text: bytes) -> bytes:
    return struct.pack("<I", len(text)) + text


def entry(key: bytes, kind: int, value: bytes) -> bytes:
    return counted(key) + struct.pack("<I", kind) + value


def u64_entry(key: bytes, value: int) -> bytes:
    return entry(key, U64, struct.pack("<Q", value))


def f64_entry(key: bytes, value: float) -> bytes:
    return entry(key, F64, struct.pack("<d", value))


def bool_entry(key: bytes, value: int) -> bytes:
    return entry(key, BOOL, bytes([value]))


def string_entry(key: bytes, value: bytes) -> bytes:
    return entry(key, STRING, counted(value))


def table_entry(name: bytes, dtype: int, shape: Sequence[int], offset: int) -> bytes:
    numbers = struct.pack(f"<{len(shape)}QQ", *shape, offset)
    return counted(name) + struct.pack("<II", dtype, len(shape)) + numbers


@dataclass
class Draft:
    """The parts of a file. What is None follows from the other parts."""

    metadata: bytes = b""
    table: bytes = b""
    tensor_count: int = 0
    data: bytes = b""
    magic: bytes = b"\x89VNR\r\n\x1a\n"
    major: int = 1
    minor: int = 0
    table_padding: bytes | None = None
    file_size: int | None = None
    metadata_bytes: int | None = None
    data_offset: int | None = None
    data_bytes: int | None = None
    data_checksum_error: int = 0
    head_checksum_error: int = 0

    def build(self) -> bytes:
        rest = self.metadata + self.table
        rest = padded(rest) if self.table_padding is None else rest + self.table_padding
        offset = 64 + len(rest)
        head = self.magic + struct.pack(
            "<IIQQQQQI",
            self.major,
            self.minor,
            offset + len(self.data) if self.file_size is None else self.file_size,
            len(self.metadata) if self.metadata_bytes is None else self.metadata_bytes,
            self.tensor_count,
            offset if self.data_offset is None else self.data_offset,
            len(self.data) if self.data_bytes is None else self.data_bytes,
            crc32c(self.data) ^ self.data_checksum_error,
        )
        checksum = crc32c(head + rest) ^ self.head_checksum_error
        return head + struct.pack("<I", checksum) + rest + self.data


def small_draft() -> Draft:
    """Every type of value, a tensor of every dtype, padding in every place that can have it."""
    return Draft(
        metadata=string_entry(b"arch", b"paper")
        + f64_entry(b"input.rms_radius", 0.5)
        + u64_entry(b"neighbours", 20)
        + bool_entry(b"relu.shared_direction", 1),
        table=table_entry(b"a.weight", F32, (2, 3), 0)
        + table_entry(b"b", I32, (1, 1, 1, 5), 64)
        + table_entry(b"c", F64_TENSOR, (9,), 128),
        tensor_count=3,
        data=padded(struct.pack("<6f", 1, -2, 3.5, 0, -0.0, 1e-40))
        + padded(struct.pack("<5i", -2, -1, 0, 1, 2))
        + padded(struct.pack("<9d", *(0.1 * i for i in range(9)))),
    )


HUGE = 2**64 - 1
# Larger than 64 bytes of data; the bytes of most do not fit 64 bits.
WRAPPING_SHAPES: list[tuple[int, ...]] = [
    (2**62,),
    (2**62 + 1,),
    (2**32, 2**32),
    (2**31, 2**31),
    (2**16,) * 4,
    (2, 2**63),
    (HUGE, HUGE),
    (HUGE,) * 4,
    (2**28 + 1,),
    (17,),
]


def one_tensor(shape: tuple[int, ...], dtype: int = F32, data: bytes = bytes(64)) -> bytes:
    return Draft(table=table_entry(b"w", dtype, shape, 0), tensor_count=1, data=data).build()


def two_tensors(first: bytes, second: bytes, offsets: tuple[int, int] = (0, 64)) -> bytes:
    table = table_entry(first, F32, (3,), offsets[0]) + table_entry(second, F32, (3,), offsets[1])
    return Draft(table=table, tensor_count=2, data=bytes(128)).build()


def with_metadata(metadata: bytes) -> bytes:
    return Draft(metadata=metadata).build()
