"""Which arrays are read in place, which are converted, and which are refused."""

from __future__ import annotations

import array
import sys
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

import vnreg

Array = NDArray[Any]


def packed(points: Array, dtype: type) -> Array:
    """As the field of a packed record: rows of 13 or 25 bytes, most of them not aligned."""
    records = np.zeros(len(points), np.dtype([("tag", "u1"), ("xyz", dtype, 3)]))
    records["xyz"] = points
    return records["xyz"]


READ_IN_PLACE: dict[str, Callable[[Array], Array]] = {
    "float64": lambda p: p.copy(),
    "float32": lambda p: p.astype(np.float32),
    "rows of six": lambda p: np.hstack([p, p])[:, :3],
    "last columns": lambda p: np.hstack([p, p])[:, 3:],
    "every second row": lambda p: np.repeat(p, 2, axis=0)[::2],
    "packed float32 record": lambda p: packed(p, np.float32),
    "packed float64 record": lambda p: packed(p, np.float64),
    "read-only": lambda p: np.frombuffer(p.tobytes()).reshape(-1, 3),
    "column order": np.asfortranarray,
    "every second column": lambda p: np.repeat(p, 2, axis=1)[:, ::2],
}
CONVERTED: dict[str, Callable[[Array], Any]] = {
    "rows backwards": lambda p: p[::-1].copy()[::-1],
    "columns backwards": lambda p: p[:, ::-1].copy()[:, ::-1],
    "other byte order": lambda p: p.astype(p.dtype.newbyteorder()),
    "long double": lambda p: p.astype(np.longdouble),
    "list of lists": lambda p: p.tolist(),
    "tuple of rows": lambda p: tuple(p),
    "torch": torch.from_numpy,
}


def rounded_to(points: Array, like: Any) -> Array:
    """What the points become in the dtype of `like`."""
    dtype = like.dtype if isinstance(like, np.ndarray) else np.dtype(np.float64)
    return points.astype(dtype).astype(np.float64)


@pytest.mark.parametrize("layout", [*READ_IN_PLACE, *CONVERTED])
def test_every_layout_gives_the_bits_of_a_contiguous_array(
    layout: str, model: vnreg.Model, pair: Any
) -> None:
    array_of = (READ_IN_PLACE | CONVERTED)[layout]
    source, target = array_of(pair.source), array_of(pair.target)
    expected = vnreg.align(
        rounded_to(pair.source, source), rounded_to(pair.target, target), model=model
    )
    result = vnreg.align(source, target, model=model)
    np.testing.assert_array_equal(result.T_target_source, expected.T_target_source)
    assert (result.rmse, result.overlap) == (expected.rmse, expected.overlap)


@pytest.mark.parametrize("dtype", [np.float16, np.int8, np.int64, np.uint16])
def test_other_real_dtypes_are_converted(dtype: type, model: vnreg.Model, pair: Any) -> None:
    source = ((pair.source - pair.source.min()) * 20).astype(dtype)
    target = ((pair.target - pair.target.min()) * 20).astype(dtype)
    result = vnreg.align(source, target, model=model)
    expected = vnreg.align(source.astype(float), target.astype(float), model=model)
    np.testing.assert_array_equal(result.T_target_source, expected.T_target_source)


def peak_of_align(source: Array, model: vnreg.Model) -> int:
    """Most bytes that numpy and Python held at once during a call."""
    registrar = vnreg.Registrar(model)
    tracemalloc.start()
    registrar.align(source, source)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_numbers_at_any_distance_are_not_copied(dtype: type, model: vnreg.Model) -> None:
    wide = np.random.default_rng(0).normal(size=(200_000, 8)).astype(dtype)
    # Less than half of the least copy; not much less, because other threads of this process count.
    least = 600_000
    assert peak_of_align(wide[:, 2:5], model) < least
    assert peak_of_align(wide[::2, 2:5], model) < least
    assert peak_of_align(wide[:, 0:6:2], model) < least
    assert peak_of_align(np.asfortranarray(wide)[:, :3], model) < least
    assert peak_of_align(wide[::-1, 2:5], model) > 200_000 * 3 * 8


@pytest.mark.parametrize(
    ("points", "shape"),
    [
        (np.zeros(3), r"\(3,\)"),
        (np.zeros((0,)), r"\(0,\)"),
        (np.zeros(()), r"\(\)"),
        (np.zeros((50, 2)), r"\(50, 2\)"),
        (np.zeros((50, 4)), r"\(50, 4\)"),
        (np.zeros((3, 50)), r"\(3, 50\)"),
        (np.zeros((50, 3, 1)), r"\(50, 3, 1\)"),
        (np.zeros((0, 0)), r"\(0, 0\)"),
        ([], r"\(0,\)"),
        (1.5, r"\(\)"),
        (array.array("d", [1, 2, 3]), r"\(3,\)"),
        (np.zeros(9, np.dtype([("x", "f8"), ("y", "f8"), ("z", "f8")]))["x"], r"\(9,\)"),
    ],
)
def test_wrong_shapes_name_the_argument_and_the_shape(
    points: Any, shape: str, model: vnreg.Model, pair: Any
) -> None:
    with pytest.raises(ValueError, match=rf"source: expected shape \(N, 3\), got {shape}"):
        vnreg.align(points, pair.target, model=model)
    with pytest.raises(ValueError, match=rf"target: expected shape \(N, 3\), got {shape}"):
        vnreg.align(pair.source, points, model=model)


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((50, 3), complex),
        np.zeros((50, 3), bool),
        np.zeros((50, 3), object),
        np.zeros((50, 3), "U3"),
        np.zeros((50, 3), "datetime64[s]"),
        np.zeros(50, np.dtype([("x", "f8"), ("y", "f8"), ("z", "f8")])),
        None,
        "points.ply",
        b"points",
    ],
)
def test_what_is_no_array_of_real_numbers_is_a_type_error(
    points: Any, model: vnreg.Model, pair: Any
) -> None:
    with pytest.raises(TypeError, match="target: expected an array of real numbers, got dtype"):
        vnreg.align(pair.source, points, model=model)


def test_ragged_rows_are_refused(model: vnreg.Model, pair: Any) -> None:
    with pytest.raises(ValueError):
        vnreg.align([[0, 0, 0], [1, 1]], pair.target, model=model)


def test_arrays_are_released_after_the_call(model: vnreg.Model, pair: Any) -> None:
    source = pair.source.copy()
    before = sys.getrefcount(source)
    for _ in range(3):
        vnreg.align(source, source, model=model)
    assert sys.getrefcount(source) == before
    memory = bytearray(source.tobytes())
    vnreg.align(memoryview(memory).cast("d", (300, 3)), source, model=model)
    memory.extend(b"x")  # refused while a buffer is exported


def test_arrays_are_released_when_the_other_is_refused(model: vnreg.Model) -> None:
    memory = bytearray(300 * 3 * 8)
    with pytest.raises(ValueError, match="target"):
        vnreg.align(memoryview(memory).cast("d", (300, 3)), np.zeros(4), model=model)
    memory.extend(b"x")


@settings(max_examples=60, deadline=None)
@given(
    points=hnp.arrays(
        st.sampled_from([np.float32, np.float64]),
        st.tuples(st.integers(0, 80), st.just(3)),
        elements={"allow_nan": True, "allow_infinity": True},
    )
)
def test_any_numbers_give_a_status_and_a_finite_pose_or_none(
    points: Array, model: vnreg.Model
) -> None:
    result = vnreg.align(points, points[::-1], model=model)
    assert np.isfinite(result.T_target_source).all() == result.has_pose
    with_pose = ("ok", "low_confidence", "ambiguous", "scales_differ")
    assert result.has_pose == (result.status in with_pose)
    if len(points) < model.min_points:
        assert result.status == "too_few_points"
    elif not (np.abs(points.astype(float)) <= 1e300).all():
        assert result.status == "not_finite"
