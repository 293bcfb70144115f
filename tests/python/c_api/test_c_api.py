"""The C API through ctypes: what a binding for another language would do."""

from __future__ import annotations

import ctypes as c
import os
import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vnreg

ROOT = Path(__file__).resolve().parents[3]
HEADER = (ROOT / "engine/include/vnreg/vnreg.h").read_text(encoding="utf-8")

Array = NDArray[Any]


class CError(c.Structure):
    _fields_ = [
        ("code", c.c_int32),
        ("field", c.c_char * 256),
        ("expected", c.c_char * 256),
        ("got", c.c_char * 256),
        ("message", c.c_char * 800),
    ]


class Cloud(c.Structure):
    _fields_ = [
        ("data", c.c_void_p),
        ("count", c.c_size_t),
        ("stride_bytes", c.c_size_t),
        ("axis_stride_bytes", c.c_size_t),
        ("scalar", c.c_int32),
        ("prepared", c.c_void_p),
    ]


class Options(c.Structure):
    _fields_ = [
        ("mode", c.c_int32),
        ("threads", c.c_int32),
        ("max_points", c.c_int32),
        ("record_stages", c.c_int32),
        ("seed", c.c_uint64),
        ("time_budget_ms", c.c_double),
        ("cancellation", c.c_void_p),
        ("drop_non_finite", c.c_int32),
    ]


class Alternative(c.Structure):
    _fields_ = [("T_target_source", c.c_double * 16), ("score", c.c_double)]


class Result(c.Structure):
    _fields_ = [
        ("status", c.c_int32),
        ("has_pose", c.c_int32),
        ("T_target_source", c.c_double * 16),
        ("T_target_source_coarse", c.c_double * 16),
        ("covariance", c.c_double * 36),
        ("confidence", c.c_double),
        ("overlap", c.c_double),
        ("rmse", c.c_double),
        ("inlier_distance", c.c_double),
        ("score", c.c_double),
        ("alternative_count", c.c_size_t),
        ("alternatives", Alternative * 4),
        ("evidence", c.c_double * 8),
        ("points_source", c.c_size_t),
        ("points_target", c.c_size_t),
        ("dropped_source", c.c_size_t),
        ("dropped_target", c.c_size_t),
        ("ms", c.c_double * 8),
    ]


class Stage(c.Structure):
    _fields_ = [
        ("name", c.c_char_p),
        ("shape", c.POINTER(c.c_size_t)),
        ("rank", c.c_size_t),
        ("values", c.POINTER(c.c_double)),
        ("count", c.c_size_t),
    ]


VERIFIED = 2


@pytest.fixture(scope="session")
def library() -> c.CDLL:
    """The shared library: the environment variable VNREG_LIBRARY, or the release build."""
    default = ROOT / "build/release/engine/libvnreg.so"
    path = Path(os.environ.get("VNREG_LIBRARY", default))
    assert path.is_file(), f"no library at {path}: build it, or set VNREG_LIBRARY"
    lib = c.CDLL(str(path))
    for name in ("version", "instruction_set", "mode_name", "status_name", "code_name"):
        getattr(lib, f"vnreg_{name}").restype = c.c_char_p
    lib.vnreg_model_name.restype = c.c_char_p
    lib.vnreg_cancellation_create.restype = c.c_void_p
    for name in ("registrar_stage_count", "prepared_size"):
        getattr(lib, f"vnreg_{name}").restype = c.c_size_t
    lib.vnreg_registrar_stage.restype = Stage
    for name in ("vnreg_cloud_f32", "vnreg_cloud_f64", "vnreg_cloud_prepared"):
        getattr(lib, name).restype = Cloud
    return lib


@pytest.fixture
def points() -> tuple[Array, Array]:
    rng = np.random.default_rng(11)
    source = rng.normal(size=(300, 3)) * [0.5, 0.3, 0.15]
    source[:, 1] += source[:, 0] ** 2
    return source, source @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]).T + [1.0, 2, 3]


def cloud(array: Array) -> Cloud:
    """Borrowed: the array must outlive it."""
    assert array.dtype in (np.float32, np.float64)
    return Cloud(
        array.ctypes.data,
        len(array),
        array.strides[0],
        array.strides[1],
        int(array.dtype == np.float64),
        None,
    )


class Registrar:
    """A handle that gives itself back."""

    def __init__(self, library: c.CDLL, **options: Any) -> None:
        self.library, self.handle = library, c.c_void_p()
        error = CError()
        chosen = Options(**({"mode": VERIFIED, "threads": 1} | options))
        code = library.vnreg_registrar_create(
            None, c.byref(chosen), c.byref(self.handle), c.byref(error)
        )
        assert code == 0, error.message

    def align(self, source: Cloud, target: Cloud) -> Result:
        result, error = Result(), CError()
        code = self.library.vnreg_registrar_align(
            self.handle, source, target, c.byref(result), c.byref(error)
        )
        assert code == 0, error.message
        return result

    def prepare(self, points: Cloud) -> c.c_void_p:
        prepared, error = c.c_void_p(), CError()
        code = self.library.vnreg_registrar_prepare(
            self.handle, points, c.byref(prepared), c.byref(error)
        )
        assert code == 0, error.message
        return prepared

    def __del__(self) -> None:
        self.library.vnreg_registrar_free(self.handle)


def assert_same(result: Result, expected: vnreg.Result, library: c.CDLL) -> None:
    assert library.vnreg_status_name(result.status).decode() == expected.status
    assert bool(result.has_pose) == expected.has_pose
    for name, shape in (
        ("T_target_source", (4, 4)),
        ("T_target_source_coarse", (4, 4)),
        ("covariance", (6, 6)),
    ):
        mine = np.array(getattr(result, name)).reshape(shape)
        np.testing.assert_array_equal(mine, getattr(expected, name))
    for name in ("confidence", "overlap", "rmse", "inlier_distance", "score"):
        np.testing.assert_array_equal(getattr(result, name), getattr(expected, name))
    assert list(result.evidence) == list(expected.evidence.values())
    assert (result.points_source, result.points_target) == (
        expected.points_source,
        expected.points_target,
    )
    assert result.alternative_count == len(expected.alternatives)
    for mine, other in zip(result.alternatives, expected.alternatives, strict=False):
        assert mine.score == other.score
        np.testing.assert_array_equal(
            np.array(mine.T_target_source).reshape(4, 4), other.T_target_source
        )
    assert result.ms[7] >= sum(result.ms[:7]) > 0


def test_it_gives_what_the_cpp_api_gives(library: c.CDLL, points: tuple[Array, Array]) -> None:
    source, target = points
    expected = vnreg.align(source, target)
    registrar = Registrar(library)
    assert_same(registrar.align(cloud(source), cloud(target)), expected, library)
    columns = np.asfortranarray(source)
    assert_same(registrar.align(cloud(columns), cloud(target)), expected, library)
    result = Result()
    assert library.vnreg_align(cloud(source), cloud(target), None, c.byref(result), None) == 0
    np.testing.assert_array_equal(
        np.array(result.T_target_source).reshape(4, 4), expected.T_target_source
    )


def test_packed_clouds_have_makers(library: c.CDLL, points: tuple[Array, Array]) -> None:
    source, target = points[0].astype(np.float32), np.ascontiguousarray(points[1])
    registrar = Registrar(library)
    f32 = library.vnreg_cloud_f32(c.c_void_p(source.ctypes.data), c.c_size_t(len(source)))
    f64 = library.vnreg_cloud_f64(c.c_void_p(target.ctypes.data), c.c_size_t(len(target)))
    assert_same(registrar.align(f32, f64), vnreg.align(source, target), library)


def test_prepared_clouds_stand_for_points(library: c.CDLL, points: tuple[Array, Array]) -> None:
    source, target = points
    registrar = Registrar(library)
    prepared = [registrar.prepare(cloud(p)) for p in (source, target)]
    clouds = [library.vnreg_cloud_prepared(p) for p in prepared]
    assert library.vnreg_prepared_status(prepared[0]) == 0
    assert library.vnreg_prepared_size(prepared[0]) == 300
    assert_same(registrar.align(*clouds), vnreg.align(source, target), library)
    again = registrar.prepare(clouds[0])
    library.vnreg_prepared_free(prepared[0])
    clouds[0] = library.vnreg_cloud_prepared(again)
    assert_same(registrar.align(*clouds), vnreg.align(source, target), library)
    for handle in (prepared[1], again, None):
        library.vnreg_prepared_free(handle)


def test_batches(library: c.CDLL, points: tuple[Array, Array]) -> None:
    source, target = points
    sources = [source[: 20 + 40 * i] for i in range(7)]
    batch, error = c.c_void_p(), CError()
    options = Options(mode=VERIFIED, threads=2)
    assert library.vnreg_batch_create(None, c.byref(options), c.byref(batch), None) == 0
    results = (Result * 7)()
    clouds = (Cloud * 7)(*(cloud(s) for s in sources))
    targets = (Cloud * 7)(*(cloud(target) for _ in sources))
    for _ in range(2):
        assert library.vnreg_batch_align(batch, clouds, targets, 7, results, c.byref(error)) == 0
        for result, one in zip(results, sources, strict=True):
            expected = vnreg.align(one, target)
            if expected.has_pose:
                assert_same(result, expected, library)
            else:
                assert library.vnreg_status_name(result.status).decode() == expected.status
    assert library.vnreg_batch_align(batch, None, None, 0, None, None) == 0
    targets[3].scalar = 9
    assert library.vnreg_batch_align(batch, clouds, targets, 7, results, c.byref(error)) == 9
    assert error.message == b"scalar: expected VNREG_FLOAT32 or VNREG_FLOAT64, got 9"
    library.vnreg_batch_free(batch)


def test_models(library: c.CDLL, points: tuple[Array, Array]) -> None:
    path = ROOT / "models/small.vnr"
    by_path, by_bytes, builtin = c.c_void_p(), c.c_void_p(), c.c_void_p()
    content = path.read_bytes()
    assert library.vnreg_model_load(os.fsencode(path), c.byref(by_path), None) == 0
    assert library.vnreg_model_from_bytes(content, len(content), c.byref(by_bytes), None) == 0
    assert library.vnreg_model_builtin(c.byref(builtin), None) == 0
    expected = vnreg.Model.load(path)
    for model, twin in (
        (by_path, expected),
        (by_bytes, expected),
        (builtin, vnreg.Model.builtin()),
    ):
        assert library.vnreg_model_name(model).decode() == twin.name
        assert library.vnreg_model_points(model) == twin.points
        assert library.vnreg_model_min_points(model) == twin.min_points
    registrar = c.c_void_p()
    options = Options(mode=1, threads=1)
    code = library.vnreg_registrar_create(by_path, c.byref(options), c.byref(registrar), None)
    assert code == 0
    for model in (by_path, by_bytes, builtin, None):
        library.vnreg_model_free(model)
    result = Result()  # the registrar shares the model's content
    source, target = points
    clouds = cloud(source), cloud(target)
    assert library.vnreg_registrar_align(registrar, *clouds, c.byref(result), None) == 0
    twin = vnreg.align(source, target, model=expected, mode="paper")
    np.testing.assert_array_equal(
        np.array(result.T_target_source).reshape(4, 4), twin.T_target_source
    )
    library.vnreg_registrar_free(registrar)


def test_stages(library: c.CDLL, points: tuple[Array, Array]) -> None:
    registrar = Registrar(library, record_stages=1)
    assert library.vnreg_registrar_stage_count(registrar.handle) == 0
    registrar.align(*(cloud(p) for p in points))
    twin = vnreg.Registrar(record_stages=True)
    twin.align(*points)
    expected = twin.stages()
    count = library.vnreg_registrar_stage_count(registrar.handle)
    assert count == len(expected)
    for i in range(count):
        stage = library.vnreg_registrar_stage(registrar.handle, c.c_size_t(i))
        values = expected[stage.name.decode()]
        assert tuple(stage.shape[: stage.rank]) == values.shape
        np.testing.assert_array_equal(stage.values[: stage.count], values.ravel())
    assert library.vnreg_registrar_stage(registrar.handle, c.c_size_t(count)).name is None


def test_a_raised_cancellation_ends_a_call(library: c.CDLL, points: tuple[Array, Array]) -> None:
    cancellation = c.c_void_p(library.vnreg_cancellation_create())
    registrar = Registrar(library, cancellation=cancellation)
    clouds = [cloud(p) for p in points]
    assert registrar.align(*clouds).has_pose
    timer = threading.Timer(0.05, library.vnreg_cancellation_request, [cancellation])
    timer.start()
    begin = time.perf_counter()
    while (result := registrar.align(*clouds)).has_pose:
        assert time.perf_counter() - begin < 20
    assert library.vnreg_status_name(result.status) == b"cancelled"
    library.vnreg_cancellation_reset(cancellation)
    assert registrar.align(*clouds).has_pose
    library.vnreg_cancellation_free(cancellation)


def test_points_that_are_no_numbers_are_refused_or_dropped(
    library: c.CDLL, points: tuple[Array, Array]
) -> None:
    source, target = points[0].copy(), points[1]
    source[7, 1] = np.nan
    refused = Registrar(library).align(cloud(source), cloud(target))
    assert library.vnreg_status_name(refused.status) == b"not_finite"
    dropping = Registrar(library, drop_non_finite=1)
    result = dropping.align(cloud(source), cloud(target))
    assert result.has_pose and (result.dropped_source, result.dropped_target) == (1, 0)
    assert dropping.align(cloud(target), cloud(source)).dropped_target == 1


def test_clouds_of_different_scales_are_said_to_be(
    library: c.CDLL, points: tuple[Array, Array]
) -> None:
    result = Registrar(library).align(cloud(points[0]), cloud(1000 * points[1]))
    assert result.has_pose
    assert library.vnreg_status_name(result.status) == b"scales_differ"


def test_a_budget_is_kept(library: c.CDLL, points: tuple[Array, Array]) -> None:
    registrar = Registrar(library, time_budget_ms=0.2)
    result = registrar.align(*(cloud(p) for p in points))
    assert library.vnreg_status_name(result.status) == b"timed_out"


def test_errors_say_what_and_where(library: c.CDLL, points: tuple[Array, Array]) -> None:
    error, handle = CError(), c.c_void_p(1)
    code = library.vnreg_model_load(b"/nowhere.vnr", c.byref(handle), c.byref(error))
    assert library.vnreg_code_name(code) == b"file_unreadable"
    assert error.code == code and handle.value is None
    with pytest.raises(vnreg.Error) as caught:
        vnreg.Model.load("/nowhere.vnr")
    assert error.message.decode() == str(caught.value)
    assert error.field.decode() == caught.value.field
    assert (error.expected.decode(), error.got.decode()) == (
        caught.value.expected,
        caught.value.got,
    )
    long = b"/" + 2000 * b"x"
    assert library.vnreg_model_load(long, c.byref(handle), c.byref(error)) == code
    assert len(error.message) == 799 and len(error.field) == 255
    assert library.vnreg_model_from_bytes(b"no model", 8, c.byref(handle), c.byref(error)) == 2
    assert library.vnreg_model_load(b"/nowhere.vnr", c.byref(handle), None) == code
    options = Options(mode=VERIFIED, threads=-3)
    code = library.vnreg_registrar_create(None, c.byref(options), c.byref(handle), c.byref(error))
    assert library.vnreg_code_name(code) == b"invalid_option"
    assert error.message == b"threads: expected 0 or 1 to 1024, got -3"
    assert library.vnreg_align(Cloud(), Cloud(), None, c.byref(Result()), c.byref(error)) == 0
    assert error.code == 0 and error.message == b""


def null_calls(library: c.CDLL) -> Iterator[tuple[int, str]]:
    handle, error, result = c.c_void_p(), CError(), Result()
    at = c.byref
    yield library.vnreg_model_load(None, at(handle), at(error)), "path"
    yield library.vnreg_model_load(b"x", None, at(error)), "model"
    yield library.vnreg_model_from_bytes(None, 5, at(handle), at(error)), "bytes"
    yield library.vnreg_model_builtin(None, at(error)), "model"
    yield library.vnreg_align(Cloud(), Cloud(), None, None, at(error)), "result"
    yield library.vnreg_registrar_create(None, None, None, at(error)), "registrar"
    yield (
        library.vnreg_registrar_align(None, Cloud(), Cloud(), at(result), at(error)),
        "registrar",
    )
    yield library.vnreg_registrar_prepare(None, Cloud(), at(handle), at(error)), "registrar"
    yield library.vnreg_batch_align(None, None, None, 0, None, at(error)), "batch"


def test_null_where_a_pointer_belongs_is_an_error(library: c.CDLL) -> None:
    calls = list(null_calls(library))
    assert [library.vnreg_code_name(code) for code, _ in calls] == [b"null_argument"] * 9
    for name in ("model", "registrar", "batch", "prepared", "cancellation"):
        getattr(library, f"vnreg_{name}_free")(None)


def test_the_words(library: c.CDLL) -> None:
    assert library.vnreg_version().decode() == vnreg.__version__
    assert library.vnreg_instruction_set().decode().startswith("x86-64")
    assert [library.vnreg_mode_name(i) for i in range(4)] == [
        b"coarse",
        b"paper",
        b"verified",
        b"unknown",
    ]
    codes = re.findall(r"^  VNREG_([A-Z_]+) = (\d+)", HEADER.split("typedef struct")[0], re.M)
    assert len(codes) == 13
    for name, value in codes:
        assert library.vnreg_code_name(int(value)).decode() == name.lower()
    for name, value in re.findall(r"VNREG_STATUS_([A-Z_]+) = (\d+)", HEADER):
        assert library.vnreg_status_name(int(value)).decode() == name.lower()


def test_every_function_of_the_header_is_in_the_library_and_tested(library: c.CDLL) -> None:
    functions = re.findall(r"^VNREG_C_API .*?(vnreg_\w+)\(", HEADER, re.M)
    assert len(functions) == HEADER.count("\nVNREG_C_API ") == 32
    tests = Path(__file__).read_text(encoding="utf-8")
    for name in functions:
        assert hasattr(library, name), name
        stem = name.removeprefix("vnreg_")
        assert stem in tests or stem.endswith("_free"), name
