"""Writer and reader of the `.vnr` container, byte for byte as model_format/SPEC.md defines it.

The C++ engine has a reader of its own; the two share nothing but the specification, make the checks
in the same order and refuse a file with the same words. The writer is deterministic: equal metadata
and tensors give equal bytes.
"""

from __future__ import annotations

import math
import os
import re
import secrets
import stat
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import google_crc32c
import numpy as np
from numpy.typing import NDArray

MetadataValue = int | float | bool | str
Tensor = NDArray[Any]

MAGIC = b"\x89VNR\r\n\x1a\n"
MAJOR_VERSION = 1
MINOR_VERSION = 0
MAX_FILE_BYTES = 1 << 30
MAX_METADATA_BYTES = 1 << 20
MAX_TENSORS = 65536
MAX_NAME_BYTES = 128
MAX_RANK = 4

_ALIGNMENT = 64
_HEADER = struct.Struct("<8sIIQQQQQII")
_HEAD_CHECKSUM_BYTE = 60
_NAME = re.compile(r"[A-Za-z0-9._]+")
_U64, _F64, _BOOL, _STRING = 1, 2, 3, 4
_DTYPES: dict[int, np.dtype[Any]] = {
    1: np.dtype("<f4"),
    2: np.dtype("<f8"),
    3: np.dtype("<i4"),
}


class ModelFileError(ValueError):
    """Bytes that break a rule of the specification, or a value that it cannot hold.

    `field` says where (with the byte, for a file), `expected` and `got` say what.
    """

    def __init__(self, field: str, expected: object, got: object) -> None:
        super().__init__(f"{field}: expected {expected}, got {got}")
        self.field = field
        self.expected = str(expected)
        self.got = str(got)


def write_model(
    path: str | os.PathLike[str],
    metadata: Mapping[str, MetadataValue],
    tensors: Mapping[str, Tensor],
) -> None:
    """Writes a file that is complete and verified before it appears under its name.

    Keys and names: 1 to 128 of A-Z a-z 0-9 . _; integers 0..2^64-1; floats finite; tensors float32,
    float64 or int32 of rank 1 to 4, without empty axes, NaN or infinity. Raises ModelFileError
    otherwise, and OSError; an existing file at `path` is then as it was.
    """
    target = Path(path)
    content = encode_model(metadata, tensors)
    temporary = target.with_name(f".{secrets.token_hex(8)}.vnr.tmp")
    try:
        with temporary.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if temporary.read_bytes() != content:
            raise ModelFileError("file read back", "the bytes that were written", "other bytes")
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
    _sync_folder(target.parent)


def read_model(
    path: str | os.PathLike[str],
) -> tuple[dict[str, MetadataValue], dict[str, Tensor]]:
    """Metadata and tensors of a file, in the order of their names.

    Raises ModelFileError for a file that breaks any rule, FileNotFoundError and other OSError.
    """
    return decode_model(_read_file(Path(path)))


def read_checksum(path: str | os.PathLike[str]) -> int:
    """The head checksum of a valid file, which identifies it; raises like read_model."""
    content = _read_file(Path(path))
    decode_model(content)
    return struct.unpack_from("<I", content, _HEAD_CHECKSUM_BYTE)[0]


def encode_model(metadata: Mapping[str, MetadataValue], tensors: Mapping[str, Tensor]) -> bytes:
    """The bytes of a file; decodes to what was given. Raises ModelFileError."""
    entries = b"".join(_encode_entry(key, metadata[key]) for key in sorted(metadata))
    _check_at_most("metadata bytes", len(entries), MAX_METADATA_BYTES)
    _check_at_most("tensor count", len(tensors), MAX_TENSORS)
    table, data = _encode_tensors(tensors)
    offset = _rounded_up(_HEADER.size + len(entries) + len(table))
    rest = (entries + table).ljust(offset - _HEADER.size, b"\0")
    _check_at_most("file size", offset + len(data), MAX_FILE_BYTES)
    head = _HEADER.pack(
        MAGIC,
        MAJOR_VERSION,
        MINOR_VERSION,
        offset + len(data),
        len(entries),
        len(tensors),
        offset,
        len(data),
        google_crc32c.value(data),
        0,
    )[:_HEAD_CHECKSUM_BYTE]
    content = head + struct.pack("<I", google_crc32c.value(head + rest)) + rest + data
    decode_model(content)
    return content


def decode_model(content: bytes) -> tuple[dict[str, MetadataValue], dict[str, Tensor]]:
    """Metadata and tensors (copies) of a file's bytes; checks every rule. Raises ModelFileError."""
    header = _decode_header(content)
    table_start = _HEADER.size + header.metadata_bytes
    metadata = _decode_metadata(_Cursor(content, _HEADER.size, table_start))
    places = _decode_table(_Cursor(content, table_start, header.data_offset), header)
    computed = google_crc32c.value(content[header.data_offset :])
    _check_equal("data checksum (byte 56)", header.data_checksum, computed)
    return metadata, {name: _decode_tensor(content, name, place) for name, place in places.items()}


def _encode_name(kind: str, name: str) -> bytes:
    if not isinstance(name, str) or not _NAME.fullmatch(name) or len(name) > MAX_NAME_BYTES:
        raise ModelFileError(kind, f"1 to {MAX_NAME_BYTES} of A-Z a-z 0-9 . _", repr(name))
    return struct.pack("<I", len(name)) + name.encode("ascii")


def _encode_entry(key: str, value: MetadataValue) -> bytes:
    field = f'metadata "{key}"'
    name = _encode_name("metadata key", key)
    if isinstance(value, bool | np.bool_):
        return name + struct.pack("<IB", _BOOL, bool(value))
    if isinstance(value, int | np.integer):
        if not 0 <= int(value) < 1 << 64:
            raise ModelFileError(field, "0 to 2^64 - 1", value)
        return name + struct.pack("<IQ", _U64, int(value))
    if isinstance(value, float | np.floating):
        if not math.isfinite(value):
            raise ModelFileError(field, "a finite number", value)
        return name + struct.pack("<Id", _F64, float(value))
    if isinstance(value, str):
        return name + _encode_string(field, value)
    raise ModelFileError(field, "int, float, bool or str", type(value).__name__)


def _encode_string(field: str, text: str) -> bytes:
    try:
        encoded = text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise ModelFileError(field, "text without surrogates", repr(text)) from error
    if b"\0" in encoded:
        raise ModelFileError(field, "text without U+0000", repr(text))
    return struct.pack("<II", _STRING, len(encoded)) + encoded


def _encode_tensors(tensors: Mapping[str, Tensor]) -> tuple[bytes, bytes]:
    table: list[bytes] = []
    data: list[bytes] = []
    offset = 0
    for name in sorted(tensors):
        tensor = tensors[name]
        code, elements = _encode_elements(name, tensor)
        table += [
            _encode_name("tensor name", name),
            struct.pack("<II", code, tensor.ndim),
            struct.pack(f"<{tensor.ndim}QQ", *tensor.shape, offset),
        ]
        data.append(elements.ljust(_rounded_up(len(elements)), b"\0"))
        offset += len(data[-1])
        _check_at_most("data bytes", offset, MAX_FILE_BYTES)
    return b"".join(table), b"".join(data)


def _encode_elements(name: str, tensor: Tensor) -> tuple[int, bytes]:
    field = f'tensor "{name}"'
    if not isinstance(tensor, np.ndarray):
        raise ModelFileError(field, "a numpy array", type(tensor).__name__)
    little = tensor.dtype.newbyteorder("<")
    code = next((code for code, dtype in _DTYPES.items() if dtype == little), 0)
    if code == 0:
        raise ModelFileError(f"{field} dtype", "float32, float64 or int32", tensor.dtype)
    if not 1 <= tensor.ndim <= MAX_RANK:
        raise ModelFileError(f"{field} rank", f"1 to {MAX_RANK}", tensor.ndim)
    if tensor.size == 0:
        raise ModelFileError(f"{field} shape", "every extent at least 1", tensor.shape)
    _check_finite(field, tensor)
    return code, tensor.astype(little, copy=False).tobytes(order="C")


class _Cursor:
    """Reads fields one after the other, never past `end`."""

    def __init__(self, content: bytes, position: int, end: int) -> None:
        self.content = content
        self.position = position
        self.end = end

    def take(self, count: int, field: str) -> bytes:
        if count > self.end - self.position:
            got = f"{self.end - self.position} bytes to the end of the section"
            raise _refusal(field, self.position, f"{count} bytes", got)
        self.position += count
        return self.content[self.position - count : self.position]

    def number(self, code: str, field: str) -> Any:
        layout = struct.Struct("<" + code)
        return layout.unpack(self.take(layout.size, field))[0]


class _Header(NamedTuple):
    """What the other parts need of the first 64 bytes."""

    metadata_bytes: int
    tensor_count: int
    data_offset: int
    data_bytes: int
    data_checksum: int


def _decode_header(content: bytes) -> _Header:
    """The header, once it fits the file and the head checksum is verified."""
    if content[: len(MAGIC)] != MAGIC:
        raise _refusal("magic", 0, MAGIC.hex(" "), _describe_magic(content[: len(MAGIC)]))
    if len(content) < _HEADER.size:
        raise _refusal("header", 0, f"{_HEADER.size} bytes", f"{len(content)} bytes")
    fields = _HEADER.unpack_from(content)
    _, major, minor, size, metadata_bytes, count, offset, data_bytes, data_crc, head_crc = fields
    if major != MAJOR_VERSION:
        expected = f"version {MAJOR_VERSION}.{MINOR_VERSION}"
        raise _refusal("major version", 8, expected, f"version {major}.{minor}")
    _check_at_most("file size (byte 16)", size, MAX_FILE_BYTES)
    _check_equal("file size (byte 16)", len(content), size)
    _check_at_most("metadata bytes (byte 24)", metadata_bytes, MAX_METADATA_BYTES)
    _check_at_most("tensor count (byte 32)", count, MAX_TENSORS)
    _check_at_most("data offset (byte 40)", offset, MAX_FILE_BYTES)
    first = _HEADER.size + metadata_bytes
    if offset % _ALIGNMENT != 0 or not first <= offset <= size:
        expected = f"a multiple of {_ALIGNMENT} from {first} to {size}"
        raise _refusal("data offset", 40, expected, offset)
    _check_at_most("data bytes (byte 48)", data_bytes, MAX_FILE_BYTES)
    _check_equal("data bytes (byte 48)", data_bytes, size - offset)
    head = content[:_HEAD_CHECKSUM_BYTE] + content[_HEADER.size : offset]
    _check_equal("head checksum (byte 60)", head_crc, google_crc32c.value(head))
    return _Header(metadata_bytes, count, offset, data_bytes, data_crc)


def _describe_magic(found: bytes) -> str:
    if found[1:4] == MAGIC[1:4]:
        return f"{found.hex(' ')} (changed by a transfer as text? copy it as binary)"
    return found.hex(" ") or "an empty file"


def _decode_name(cursor: _Cursor, field: str, previous: str) -> str:
    start = cursor.position
    length = cursor.number("I", f"{field} length")
    if not 1 <= length <= MAX_NAME_BYTES:
        raise _refusal(f"{field} length", start, f"1 to {MAX_NAME_BYTES}", length)
    start = cursor.position
    name = cursor.take(length, field).decode("latin-1")
    if not _NAME.fullmatch(name):
        good = _NAME.match(name)
        bad = good.end() if good else 0
        got = f"a byte of value {ord(name[bad])}"
        raise _refusal(field, start + bad, "A-Z a-z 0-9 . _ only", got)
    if name <= previous:
        raise _refusal(field, start, f'a name after "{previous}"', f'"{name}"')
    return name


def _decode_metadata(cursor: _Cursor) -> dict[str, MetadataValue]:
    metadata: dict[str, MetadataValue] = {}
    key = ""
    while cursor.position < cursor.end:
        key = _decode_name(cursor, f"metadata key {len(metadata)}", key)
        metadata[key] = _decode_value(cursor, f'metadata "{key}"')
    return metadata


def _decode_value(cursor: _Cursor, field: str) -> MetadataValue:
    start = cursor.position
    code = cursor.number("I", f"{field} type")
    if code == _U64:
        return int(cursor.number("Q", field))
    if code == _F64:
        value = float(cursor.number("d", field))
        if not math.isfinite(value):
            raise _refusal(field, start + 4, "a finite number", _word_for(value))
        return value
    if code == _BOOL:
        flag = cursor.number("B", field)
        if flag > 1:
            raise _refusal(field, start + 4, "0 or 1", flag)
        return bool(flag)
    if code == _STRING:
        return _decode_string(cursor, field)
    expected = f"{_U64} (u64), {_F64} (f64), {_BOOL} (bool) or {_STRING} (string)"
    raise _refusal(f"{field} type", start, expected, code)


def _decode_string(cursor: _Cursor, field: str) -> str:
    length = cursor.number("I", f"{field} length")
    start = cursor.position
    encoded = cursor.take(length, field)
    bad = encoded.find(0)
    try:
        text = encoded.decode("utf-8")
    except UnicodeDecodeError as error:
        bad = error.start if bad < 0 else min(bad, error.start)
    if bad >= 0:
        got = f"a sequence that starts with {encoded[bad]}"
        raise _refusal(field, start + bad, "UTF-8 without U+0000", got)
    return text


class _Place(NamedTuple):
    """Where a tensor's elements lie in the file, and what they are."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    begin: int
    end: int


def _decode_table(table: _Cursor, header: _Header) -> dict[str, _Place]:
    """The places of all tensors; the elements are not looked at."""
    places: dict[str, _Place] = {}
    name = ""
    offset = 0
    for index in range(header.tensor_count):
        name = _decode_name(table, f"name of tensor {index}", name)
        places[name] = _decode_place(table, name, header, offset)
        offset = _rounded_up(places[name].end) - header.data_offset
    end = _rounded_up(table.position)
    _check_equal("data offset (byte 40)", header.data_offset, end)
    field = "padding after the tensor table"
    _check_zero(table.content, table.position, header.data_offset, field)
    _check_equal("data bytes (byte 48)", header.data_bytes, offset)
    return places


def _decode_place(table: _Cursor, name: str, header: _Header, expected_offset: int) -> _Place:
    """One entry of the table after its name; its elements must start at `expected_offset`."""
    field = f'tensor "{name}"'
    start = table.position
    code = table.number("I", f"{field} dtype")
    if code not in _DTYPES:
        raise _refusal(f"{field} dtype", start, "1 (f32), 2 (f64) or 3 (i32)", code)
    dtype = _DTYPES[code]
    shape, size = _decode_shape(table, field, dtype.itemsize)
    start = table.position
    offset = table.number("Q", f"{field} offset")
    if offset != expected_offset:
        raise _refusal(f"{field} offset", start, expected_offset, offset)
    room = header.data_bytes - offset
    if _rounded_up(size) > room:
        expected = f"at most {room} bytes of data"
        raise _refusal(f"{field} padded size", start, expected, _rounded_up(size))
    begin = header.data_offset + offset
    return _Place(dtype, shape, begin, begin + size)


def _decode_shape(table: _Cursor, field: str, size: int) -> tuple[tuple[int, ...], int]:
    """The shape, and the bytes of all elements, given those of one."""
    start = table.position
    rank = table.number("I", f"{field} rank")
    if not 1 <= rank <= MAX_RANK:
        raise _refusal(f"{field} rank", start, f"1 to {MAX_RANK}", rank)
    shape: list[int] = []
    for axis in range(rank):
        start = table.position
        extent = table.number("Q", f"{field} extent of axis {axis}")
        most = MAX_FILE_BYTES // size
        if not 1 <= extent <= most:
            raise _refusal(f"{field} extent of axis {axis}", start, f"1 to {most}", extent)
        size *= extent
        shape.append(extent)
    return tuple(shape), size


def _decode_tensor(content: bytes, name: str, place: _Place) -> Tensor:
    """A copy of the elements, and a look at the padding behind them."""
    field = f'tensor "{name}"'
    count = math.prod(place.shape)
    view = np.frombuffer(content, dtype=place.dtype, count=count, offset=place.begin)
    if view.dtype.kind == "f" and not np.isfinite(view).all():
        bad = int(np.flatnonzero(~np.isfinite(view))[0])
        byte = place.begin + bad * view.dtype.itemsize
        raise _refusal(f"{field} element {bad}", byte, "a finite number", _word_for(view[bad]))
    _check_zero(content, place.end, _rounded_up(place.end), f"padding after {field}")
    return view.reshape(place.shape).astype(place.dtype.newbyteorder("="), copy=True)


def _word_for(value: float) -> str:
    return "NaN" if math.isnan(value) else "infinity"


def _read_file(path: Path) -> bytes:
    with open(path, "rb", opener=_open_without_waiting) as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise ModelFileError(f'file "{path}"', "a regular file", "a pipe or a device")
        if status.st_size > MAX_FILE_BYTES:
            expected, got = f"at most {MAX_FILE_BYTES} bytes", f"{status.st_size} bytes"
            raise ModelFileError(f'file "{path}"', expected, got)
        content = file.read(status.st_size)
    if len(content) < status.st_size:
        got = f"{len(content)} bytes: it shrank while it was read"
        raise ModelFileError(f'file "{path}"', f"{status.st_size} bytes", got)
    return content


def _open_without_waiting(path: str, flags: int) -> int:
    # A named pipe without a writer is then refused instead of waited for.
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _sync_folder(folder: Path) -> None:
    """Makes the new name durable, not only the content; systems without it need no call."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _rounded_up(size: int) -> int:
    return -(-size // _ALIGNMENT) * _ALIGNMENT


def _refusal(field: str, byte: int, expected: object, got: object) -> ModelFileError:
    return ModelFileError(f"{field} (byte {byte})", expected, got)


def _check_at_most(field: str, got: int, cap: int) -> None:
    if got > cap:
        raise ModelFileError(field, f"at most {cap}", got)


def _check_equal(field: str, got: object, expected: object) -> None:
    if got != expected:
        raise ModelFileError(field, expected, got)


def _check_zero(content: bytes, begin: int, end: int, field: str) -> None:
    padding = content[begin:end]
    if any(padding):
        bad = next(i for i, byte in enumerate(padding) if byte != 0)
        raise _refusal(field, begin + bad, 0, padding[bad])


def _check_finite(field: str, tensor: Tensor) -> None:
    if tensor.dtype.kind == "f" and not np.isfinite(tensor).all():
        bad = int(np.flatnonzero(~np.isfinite(tensor))[0])
        raise ModelFileError(f"{field} element {bad}", "a finite number", tensor.flat[bad])
