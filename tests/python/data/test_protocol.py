"""Evaluation pairs: the facts that are known of both protocols, and the errors."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vnreg_train.data.protocol import (
    ANGLES_DEG,
    PROTOCOLS,
    SETTINGS,
    euler_rotation,
    make_pair,
    pairs,
    random_pose,
    recall,
    rotation_error_deg,
    translation_error,
)


def in_target_frame(pair) -> np.ndarray:
    pose = pair.T_target_source
    return pair.source @ pose[:3, :3].T + pose[:3, 3]


def common_points(pair) -> int:
    """How many points of the source, moved by the true pose, are points of the target."""
    moved, target = in_target_frame(pair), pair.target.astype(np.float64)
    gaps = np.array([np.abs(target - point).max(axis=1).min() for point in moved])
    return int((gaps < 1e-6).sum())


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("setting", SETTINGS)
def test_shapes_types_and_repeatability(random_shapes, setting, protocol):
    pair = make_pair(random_shapes, 2, setting, 180, protocol)
    kept = 768 if "partial" in setting else 1024
    assert pair.source.shape == pair.target.shape == (kept, 3)
    assert pair.source.dtype == pair.target.dtype == np.float32
    assert pair.T_target_source.dtype == np.float64
    assert (pair.shape, pair.name, pair.setting) == (2, "c", setting)
    assert (pair.same_crop is not None) == ("partial" in setting and protocol == "P0")
    rotation = pair.T_target_source[:3, :3]
    assert np.allclose(rotation @ rotation.T, np.eye(3))
    assert np.isclose(np.linalg.det(rotation), 1)
    assert np.abs(pair.T_target_source[:3, 3]).max() <= 0.5
    again = make_pair(random_shapes, 2, setting, 180.0, protocol)
    for field in dataclasses.fields(pair):
        assert np.array_equal(getattr(pair, field.name), getattr(again, field.name))


def test_any_pair_can_be_made_alone_and_in_any_order(random_shapes):
    forward = list(pairs(random_shapes, "partial", 90))
    backward = list(pairs(random_shapes, "partial", 90, indices=[4, 3, 2, 1, 0]))[::-1]
    for one, other in zip(forward, backward, strict=True):
        assert np.array_equal(one.source, other.source)
        assert np.array_equal(one.T_target_source, other.T_target_source)


def test_pairs_differ_by_every_argument(random_shapes):
    base = make_pair(random_shapes, 0, "clean", 90)
    others = [
        make_pair(random_shapes, 1, "clean", 90),
        make_pair(random_shapes, 0, "noisy", 90),
        make_pair(random_shapes, 0, "clean", 135),
        make_pair(random_shapes, 0, "clean", 90, "text"),
        make_pair(random_shapes, 0, "clean", 90, seed=1),
    ]
    for other in others:
        assert not np.allclose(base.T_target_source, other.T_target_source)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_clean_has_the_same_points_in_another_order(random_shapes, protocol):
    pair = make_pair(random_shapes, 0, "clean", 180, protocol)
    assert common_points(pair) == 1024
    gaps = np.linalg.norm(in_target_frame(pair) - pair.target, axis=1)
    assert (gaps > 1e-3).mean() > 0.98
    assert pair.overlap == 1


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_noise_is_independent_and_clipped(random_shapes, protocol, monkeypatch):
    monkeypatch.setattr(np.random, "default_rng", unshuffled(np.random.default_rng))
    pair = make_pair(random_shapes, 0, "noisy", 180, protocol)
    gaps = in_target_frame(pair) - pair.target
    assert np.allclose(gaps.std(), 0.01 * 2**0.5, rtol=0.05)
    assert np.abs(gaps.mean(axis=0)).max() < 0.002
    clean = make_pair(random_shapes, 0, "clean", 180, protocol)
    noise = pair.source - clean.source
    assert np.allclose(noise.std(), 0.01, rtol=0.05)
    monkeypatch.setattr("vnreg_train.data.protocol.NOISE_SIGMA", 1.0)
    wild = make_pair(random_shapes, 0, "noisy", 180, protocol).source - clean.source
    assert np.isclose(np.abs(wild).max(), 0.05)


def unshuffled(make):
    """A default_rng whose permutation of clouds keeps their order, to see who is who."""

    class Ordered(np.random.Generator):
        def permutation(self, x, axis=0):
            return x

    return lambda seed: Ordered(make(seed).bit_generator)


def test_independent_shares_half_its_points_in_p0_and_none_in_text(random_shapes):
    counts = [common_points(pair) for pair in pairs(random_shapes, "independent", 180)]
    assert np.all(np.abs(np.array(counts) - 512) < 5 * 16)
    text = [common_points(pair) for pair in pairs(random_shapes, "independent", 180, "text")]
    assert text == [0] * 5


def test_partial_of_p0_is_cut_along_one_diagonal(random_shapes):
    found = [
        make_pair(random_shapes, index, "partial", 180, seed=seed)
        for index in range(5)
        for seed in range(40)
    ]
    same = np.array([pair.same_crop for pair in found])
    overlap = np.array([pair.overlap for pair in found])
    assert 0.35 < same.mean() < 0.65
    assert np.allclose(overlap[~same], 2 / 3, atol=0.01)
    assert (overlap[same] > 0.98).all()
    for pair in found[:5]:
        shared = common_points(pair)
        assert abs(shared - pair.overlap * 768) <= 1
        assert shared >= 512
        depth = pair.source.astype(np.float64).sum(axis=1)
        # Heights on an ellipsoid made from a sphere are uniform: 25 % lie below half its radius.
        assert np.isclose(min(-depth.min(), depth.max()), 0.5**0.5 / 2, atol=0.03)


def test_partial_of_text_has_any_direction(random_shapes):
    found = list(pairs(random_shapes, "partial", 180, "text"))
    found += [make_pair(random_shapes, 0, "partial", 180, "text", seed) for seed in range(60)]
    overlap = np.array([pair.overlap for pair in found])
    assert overlap.min() < 0.72
    assert overlap.max() > 0.9
    assert overlap.min() >= 2 / 3 - 1e-9
    for pair in found[:5]:
        assert abs(common_points(pair) - pair.overlap * 768) <= 1


def test_partial_and_independent_together(random_shapes):
    pair = make_pair(random_shapes, 1, "partial_independent", 180, "text")
    assert common_points(pair) == 0
    assert 0.5 < pair.overlap <= 1
    p0 = make_pair(random_shapes, 1, "partial_independent", 180, "P0")
    assert 150 < common_points(p0) < 450


@pytest.mark.parametrize("angle", ANGLES_DEG)
def test_poses_are_euler_angles_of_the_range(angle):
    rng = np.random.default_rng(0)
    poses = np.stack([random_pose(rng, angle) for _ in range(3000)])
    angles = Rotation.from_matrix(poses[:, :3, :3]).as_euler("XYZ", degrees=True)
    if angle <= 90:
        assert angles.min() >= 0
        assert np.allclose(angles.mean(axis=0), angle / 2, atol=angle / 30)
        assert angles.max() <= angle
    largest = rotation_error_deg(np.eye(4), poses).max()
    assert largest > {45: 75, 90: 165, 135: 175, 180: 175}[angle]
    assert largest < {45: 90, 90: 180}.get(angle, 181)
    assert np.allclose(poses[:, :3, 3].mean(axis=0), 0, atol=0.03)
    assert np.abs(poses[:, :3, 3]).max() > 0.49


@given(st.tuples(*[st.floats(-np.pi, np.pi)] * 3))
def test_euler_rotations_follow_rx_ry_rz(angles):
    expected = Rotation.from_euler("XYZ", angles).as_matrix()
    assert np.allclose(euler_rotation(angles), expected, atol=1e-12)


def test_euler_angles_to_180_cover_about_a_quarter_of_all_rotations():
    matrices = Rotation.random(20_000, rng=np.random.default_rng(0)).as_matrix()
    first = Rotation.from_matrix(matrices).as_euler("XYZ", degrees=True)
    second = np.stack([first[:, 0] + 180, 180 - first[:, 1], first[:, 2] + 180], axis=1)
    covered = [((a + 360) % 360 <= 180).all(axis=1) for a in (first, second)]
    assert 0.22 < (covered[0] | covered[1]).mean() < 0.28


@given(st.floats(1e-9, 180.0), st.integers(0, 1000))
def test_rotation_error_is_exact_for_small_and_large_angles(angle, seed):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(np.deg2rad(angle) * axis / np.linalg.norm(axis)).as_matrix()
    base = Rotation.random(rng=rng).as_matrix()
    assert np.isclose(rotation_error_deg(base, base @ turn), angle, rtol=1e-6, atol=1e-13)
    assert np.isclose(rotation_error_deg(base @ turn, base), angle, rtol=1e-6, atol=1e-13)


def test_errors_of_batches():
    poses = np.stack([random_pose(np.random.default_rng(k), 180) for k in range(4)])
    moved = poses.copy()
    moved[:, 0, 3] += 0.3
    assert np.allclose(translation_error(poses, moved), 0.3)
    assert np.allclose(rotation_error_deg(poses, moved), 0)
    assert rotation_error_deg(poses[0], poses).shape == (4,)


def test_recall():
    assert recall([4.9, 5.0, 1.0, np.nan], [0.1, 0.1, 0.2, 0.0]) == 0.25
    assert recall([4.9], [0.1], max_rotation_deg=1) == 0
    with pytest.raises(ValueError, match="errors of shapes"):
        recall([1.0], [])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, "foggy", 180), "setting must be one of clean"),
        ((0, "clean", 180, "P1"), "protocol must be one of P0, text"),
        ((5, "clean", 180), r"shape index 5 is outside 0\.\.4"),
        ((-1, "clean", 180), "shape index -1"),
    ],
)
def test_unknown_arguments_are_refused(random_shapes, arguments, message):
    with pytest.raises(ValueError, match=message):
        make_pair(random_shapes, *arguments)


def test_too_few_points_are_refused(random_shapes):
    few = dataclasses.replace(random_shapes, surface=random_shapes.surface[:, :2047])
    with pytest.raises(ValueError, match="pairs need 2048 points per shape, there are 2047"):
        make_pair(few, 0, "clean", 45)
