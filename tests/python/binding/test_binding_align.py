"""Alignment from Python: results, options, stages, threads."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import vnreg


def test_a_known_pose_is_found(model: vnreg.Model, pair: Any) -> None:
    result = vnreg.align(pair.source, pair.target, model=model, mode="coarse")
    assert result.status == "ok" and result.has_pose
    np.testing.assert_allclose(result.T_target_source, pair.T_target_source, atol=1e-5)
    np.testing.assert_array_equal(result.T_target_source, result.T_target_source_coarse)
    assert result.T_target_source.shape == (4, 4)
    assert result.T_target_source.dtype == np.float64
    assert result.overlap == 1.0
    assert 0 <= result.rmse < 1e-5 < result.inlier_distance < 0.5
    assert (result.points_source, result.points_target) == (300, 300)


def test_the_pose_maps_source_onto_target_and_not_back(model: vnreg.Model, pair: Any) -> None:
    pose = vnreg.align(pair.target, pair.source, model=model, mode="coarse").T_target_source
    np.testing.assert_allclose(pose, np.linalg.inv(pair.T_target_source), atol=1e-5)


def test_function_and_registrar_agree_bit_for_bit(model: vnreg.Model, pair: Any) -> None:
    registrar = vnreg.Registrar(model)  # in the default mode, like the function
    for _ in range(2):
        result = registrar.align(pair.source, pair.target)
        once = vnreg.align(pair.source, pair.target, model=model)
        np.testing.assert_array_equal(result.T_target_source, once.T_target_source)


def test_the_number_of_threads_changes_no_bit(model: vnreg.Model, pair: Any) -> None:
    poses = [
        vnreg.align(pair.source, pair.target, model=model, threads=threads).T_target_source
        for threads in (0, 1, 2, 3)
    ]
    for pose in poses[1:]:
        np.testing.assert_array_equal(pose, poses[0])


def test_a_result_outlives_later_calls_and_its_arrays_are_copies(
    model: vnreg.Model, pair: Any
) -> None:
    registrar = vnreg.Registrar(model)
    result = registrar.align(pair.source, pair.target)
    pose = result.T_target_source
    kept = pose.copy()
    registrar.align(pair.target, pair.source)
    pose[:] = 0
    np.testing.assert_array_equal(result.T_target_source, kept)


@pytest.mark.parametrize(
    ("points", "status"),
    [
        (np.zeros((0, 3)), "too_few_points"),
        (np.random.default_rng(0).normal(size=(23, 3)), "too_few_points"),
        (np.full((100, 3), np.nan), "not_finite"),
        (np.full((100, 3), np.inf), "not_finite"),
        (np.full((100, 3), 2.5), "degenerate"),
    ],
)
def test_clouds_without_a_pose_have_nan_not_the_identity(
    points: Any, status: str, model: vnreg.Model, pair: Any
) -> None:
    for result in (
        vnreg.align(points, pair.target, model=model),
        vnreg.align(pair.source, points, model=model),
    ):
        assert result.status == status
        assert not result.has_pose
        assert np.isnan(result.T_target_source).all()
        assert np.isnan(result.T_target_source_coarse).all()


def test_times_of_the_stages_add_up(model: vnreg.Model, pair: Any) -> None:
    stages = ["prepare", "encode", "coarse", "fine", "hypotheses", "verify", "measure"]
    paper = vnreg.align(pair.source, pair.target, model=model, mode="paper").ms
    assert {name for name in stages if paper[name] == 0} == {"hypotheses", "verify"}
    ms = vnreg.align(pair.source, pair.target, model=model).ms
    assert list(ms) == [*stages, "total"]
    assert all(ms[name] > 0 for name in stages)
    assert 0.5 * ms["total"] < sum(ms[name] for name in stages) <= ms["total"] * 1.001


def test_large_clouds_are_subsampled_by_the_seed(model: vnreg.Model) -> None:
    points = np.random.default_rng(3).normal(size=(5000, 3)) * [0.5, 0.3, 0.1]

    def pose(**options: Any) -> Any:
        result = vnreg.align(points, points[::-1], model=model, mode="coarse", **options)
        assert result.points_source == result.points_target == options.get("max_points", 512)
        return result.T_target_source

    np.testing.assert_array_equal(pose(seed=5), pose(seed=5))
    assert (pose(seed=5) != pose(seed=6)).any()
    assert (pose(max_points=100) != pose(max_points=200)).any()
    assert (pose(seed=2**64 - 1) != pose(seed=0)).any()


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"mode": "fast"}, "mode"),
        ({"mode": ""}, "mode"),
        ({"threads": -1}, "threads"),
        ({"threads": 5000}, "threads"),
        ({"max_points": 10}, "max_points"),
        ({"max_points": -5}, "max_points"),
        ({"max_points": 100_000}, "max_points"),
        ({"time_budget_ms": -1.5}, "time_budget_ms"),
        ({"time_budget_ms": float("nan")}, "time_budget_ms"),
    ],
)
def test_options_out_of_range_name_the_field(
    options: dict[str, Any], field: str, model: vnreg.Model, pair: Any
) -> None:
    for call in (
        lambda: vnreg.Registrar(model, **options),
        lambda: vnreg.align(pair.source, pair.target, model=model, **options),
        lambda: vnreg.align_many([(pair.source, pair.target)], model=model, **options),
    ):
        with pytest.raises(vnreg.Error) as caught:
            call()
        assert caught.value.code == "invalid_option"
        assert caught.value.field == field
        assert str(next(iter(options.values()))) in caught.value.got


@pytest.mark.parametrize("options", [{"seed": -1}, {"seed": 2**64}, {"mode": 3}, {"speed": 1}])
def test_options_of_the_wrong_kind_are_type_errors(
    options: dict[str, Any], model: vnreg.Model
) -> None:
    with pytest.raises(TypeError):
        vnreg.Registrar(model, **options)


def test_stages_are_recorded_only_when_asked_for(model: vnreg.Model, pair: Any) -> None:
    silent = vnreg.Registrar(model)
    silent.align(pair.source, pair.target)
    assert silent.stages() == {}
    recorder = vnreg.Registrar(model, record_stages=True)
    assert recorder.stages() == {}
    recorder.align(pair.source, pair.target[:250])
    stages = recorder.stages()
    assert stages["source.points"].shape == (300, 3)
    assert stages["target.points"].shape == (250, 3)
    assert stages["source.global"].shape == (16, 3)
    assert stages["source.network2.block1"].shape == (300, 8, 3)
    assert stages["fine.2.similarity"].shape == (50, 41)
    for name in ("source.kept", "target.kept", "fine.0.match"):
        assert stages[name].dtype == np.int64
    assert {value.dtype.name for value in stages.values()} == {"float64", "int64"}


def test_stages_follow_the_mode_and_the_last_call(model: vnreg.Model, pair: Any) -> None:
    recorder = vnreg.Registrar(model, mode="coarse", record_stages=True)
    recorder.align(pair.source, pair.target)
    assert "coarse.T" in recorder.stages()
    assert not [name for name in recorder.stages() if name.startswith("fine")]
    recorder.align(pair.source[:3], pair.target)
    assert recorder.stages() == {}


def test_stage_arrays_stay_valid_without_the_registrar(model: vnreg.Model, pair: Any) -> None:
    recorder = vnreg.Registrar(model, record_stages=True)
    recorder.align(pair.source, pair.target)
    first, second = recorder.stages(), recorder.stages()
    first["source.points"][:] = 7
    del recorder, first
    assert not (second["source.points"] == 7).any()
    assert abs(second["source.points"].mean()) < 1e-6


def test_other_python_threads_run_during_align(model: vnreg.Model) -> None:
    points = np.random.default_rng(0).normal(size=(3_000_000, 3))
    registrar = vnreg.Registrar(model)
    span: list[float] = []

    def work() -> None:
        begin = time.perf_counter()
        registrar.align(points, points)
        span.extend([begin, time.perf_counter()])

    worker = threading.Thread(target=work)
    ticks: list[float] = []
    worker.start()
    while worker.is_alive():
        ticks.append(time.perf_counter())
        time.sleep(0)
    begin, end = span
    third = (end - begin) / 3
    assert any(begin + third < tick < end - third for tick in ticks)


def test_threads_that_share_a_registrar_get_their_own_results(
    model: vnreg.Model, pair: Any
) -> None:
    registrar = vnreg.Registrar(model)
    sources = [pair.source[: 100 + 20 * i] for i in range(10)]
    expected = [registrar.align(s, pair.target).T_target_source for s in sources]
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda s: registrar.align(s, pair.target), sources * 8))
    for index, result in enumerate(results):
        np.testing.assert_array_equal(result.T_target_source, expected[index % 10])
        assert result.points_source == 100 + 20 * (index % 10)


def test_repr_tells_the_status(model: vnreg.Model, pair: Any) -> None:
    assert "status='ok'" in repr(vnreg.align(pair.source, pair.target, model=model))
    assert "too_few_points" in repr(vnreg.align(pair.source[:2], pair.target, model=model))
