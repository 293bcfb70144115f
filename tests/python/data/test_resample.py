"""Training batches: repeatable, resumable, fresh and fast."""

import dataclasses
import pickle
import time

import numpy as np
import pytest

from vnreg_train.data.resample import SETTINGS, TrainingSampler

N = 300


def sampler(shapes, mix="clean", batch=8, **options):
    return TrainingSampler(shapes, N, batch, {mix: 1.0}, options.pop("seed", 0), 64, **options)


def common(source, target) -> int:
    gaps = [np.abs(target - point).max(axis=1).min() for point in source]
    return int((np.array(gaps) < 1e-7).sum())


def test_shapes_and_types(random_shapes):
    batch = TrainingSampler(random_shapes, N, 4, dict.fromkeys(SETTINGS, 1.0), 0, 64).batch(0)
    assert {key: value.shape for key, value in batch.items()} == {
        "source": (4, N, 3),
        "target": (4, N, 3),
        "queries": (4, 64, 3),
        "occupancies": (4, 64),
    }
    assert all(value.dtype == np.float32 for value in batch.values())


def test_queries_are_left_out_where_there_are_none(random_shapes):
    bare = dataclasses.replace(random_shapes, queries=None, occupancies=None)
    assert set(sampler(bare).batch(0)) == {"source", "target"}
    assert set(TrainingSampler(random_shapes, N, 4, {"clean": 1}, 0, 0).batch(0)) == {
        "source",
        "target",
    }


@pytest.mark.parametrize("setting", SETTINGS)
def test_points_in_common(random_shapes, setting):
    batch = sampler(random_shapes, setting).batch(0)
    counts = [common(*clouds) for clouds in zip(batch["source"], batch["target"], strict=True)]
    expected = {"clean": [N, N], "half": [N // 2, N // 2], "partial": [2 / 3 * N, N]}
    low, high = expected.get(setting, [0, 0])
    assert low - 1 <= min(counts)
    assert max(counts) <= high


def test_noise_has_any_strength(random_shapes):
    batch = sampler(random_shapes, "noisy", batch=60).batch(0)
    gaps = np.array(
        [
            np.median(np.linalg.norm(t[None] - s[:, None], axis=2).min(axis=1))
            for s, t in zip(batch["source"], batch["target"], strict=True)
        ]
    )
    assert gaps.min() < 0.004
    assert 0.008 < gaps.max() < 0.03


def test_crops_keep_a_half_space_of_three_quarters(random_shapes):
    batch = sampler(random_shapes, "partial_independent", batch=40).batch(0)
    offsets = np.linalg.norm(batch["source"].mean(axis=1), axis=1)
    assert offsets.min() > 0.03
    diagonal = np.abs(batch["source"].mean(axis=1)) / np.array([0.25, 0.16, 0.09])
    spread = diagonal.std(axis=1) / diagonal.mean(axis=1)
    assert 0.2 < (spread < 0.3).mean() < 0.9


@pytest.mark.parametrize("diagonal_crops", [0.0, 1.0])
def test_crops_are_along_the_diagonal_as_often_as_asked(random_shapes, diagonal_crops) -> None:
    """What a crop along (1, 1, 1) leaves ends at a plane across it; other crops do not."""
    batch = sampler(random_shapes, "partial", batch=20, diagonal_crops=diagonal_crops).batch(0)
    cut = []
    for source, target in zip(batch["source"], batch["target"], strict=True):
        both = np.concatenate([source, target]) @ np.ones(3)
        ends = [(cloud @ np.ones(3)).min() > both.min() + 0.02 for cloud in (source, target)]
        ends += [(cloud @ np.ones(3)).max() < both.max() - 0.02 for cloud in (source, target)]
        shared = common(source, target)
        cut.append(shared == N or (sum(ends) == 2 and abs(shared - 2 / 3 * N) <= 1))
    assert (np.mean(cut) == 1) == (diagonal_crops == 1)


def test_an_epoch_is_every_shape_once_in_random_order(random_shapes):
    one = sampler(random_shapes, batch=3)
    order = np.concatenate([one.shape_indices(k) for k in range(10)])
    epochs = order.reshape(6, 5)
    assert (np.sort(epochs, axis=1) == np.arange(5)).all()
    assert len(np.unique(epochs, axis=0)) > 1


def test_every_epoch_has_fresh_points(random_shapes):
    one = sampler(random_shapes, batch=5)
    first, second = one.batch(0), one.batch(1)
    rows = [list(one.shape_indices(k)).index(2) for k in (0, 1)]
    shared = common(first["source"][rows[0]], second["source"][rows[1]])
    assert shared < 0.25 * N


def test_batches_are_functions_of_seed_and_number(random_shapes):
    mix = dict.fromkeys(SETTINGS, 1.0)
    one = TrainingSampler(random_shapes, N, 4, mix, 3, 64, augment=True)
    two = TrainingSampler(random_shapes, N, 4, mix, 3, 64, augment=True)
    for index in (7, 0, 3):
        expected = one.batch(index)
        for key, value in two.batch(index).items():
            assert np.array_equal(value, expected[key])
    other = TrainingSampler(random_shapes, N, 4, mix, 4, 64, augment=True)
    assert not np.array_equal(other.batch(0)["source"], one.batch(0)["source"])


def test_a_sampler_can_be_sent_to_another_process(random_shapes):
    one = sampler(random_shapes, "half")
    one.batch(2)
    copy = pickle.loads(pickle.dumps(one))
    assert np.array_equal(copy.batch(5)["source"], one.batch(5)["source"])


def test_state_restores_the_sequence(random_shapes):
    one = sampler(random_shapes, "half")
    for _ in range(3):
        next(one)
    state, expected = one.state_dict(), next(one)
    two = sampler(random_shapes, "half")
    two.load_state_dict(state)
    assert np.array_equal(next(iter(two))["source"], expected["source"])
    assert two.state_dict() == one.state_dict()


@pytest.mark.parametrize("change", ["seed", "mix", "points", "batch", "shapes"])
def test_a_state_of_another_sampler_is_refused(random_shapes, change):
    state = sampler(random_shapes).state_dict()
    other = {
        "seed": lambda: sampler(random_shapes, seed=1),
        "mix": lambda: sampler(random_shapes, "noisy"),
        "points": lambda: TrainingSampler(random_shapes, N + 1, 8, {"clean": 1.0}, 0, 64),
        "batch": lambda: sampler(random_shapes, batch=9),
        "shapes": lambda: sampler(random_shapes.subset([0, 1])),
    }[change]()
    with pytest.raises(ValueError, match=f"sampler state: {change} was"):
        other.load_state_dict(state)


def test_augmentation_stretches_points_and_queries_alike(random_shapes):
    batch = sampler(random_shapes, batch=40, augment=True).batch(0)
    sides = np.ptp(batch["source"], axis=1)
    assert np.allclose(sides.max(axis=1), 1, atol=0.06)
    assert sides[:, 1].std() > 0.08
    for cloud, queries, inside in zip(
        batch["source"], batch["queries"], batch["occupancies"], strict=True
    ):
        axes = np.abs(cloud).max(axis=0)
        value = ((queries / axes) ** 2).sum(axis=1)
        decided = np.abs(value - 1) > 0.2
        assert ((value < 1) == inside)[decided].all()
    plain = sampler(random_shapes, batch=40).batch(0)
    assert np.allclose(np.ptp(plain["source"], axis=1), [1, 0.8, 0.6], atol=0.06)


def test_the_mix_is_kept(random_shapes):
    mixed = TrainingSampler(random_shapes, 50, 400, {"clean": 3, "independent": 1}, 0, 0).batch(0)
    shared = np.array([common(s, t) for s, t in zip(mixed["source"], mixed["target"], strict=True)])
    assert set(shared) == {0, 50}
    assert abs((shared == 50).mean() - 0.75) < 0.07


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"settings_mix": {"foggy": 1}}, "unknown settings"),
        ({"settings_mix": {}}, "sum > 0"),
        ({"settings_mix": {"clean": -1, "noisy": 3}}, "weights of settings"),
        ({"settings_mix": {"clean": np.nan}}, "weights of settings"),
        ({"points": 0}, "must be >= 1"),
        ({"batch": 0}, "must be >= 1"),
        ({"points": 5000}, "5000 points per shape needed, have 4096"),
        ({"points": 2000, "settings_mix": {"partial_independent": 1}}, "5332 points per shape"),
        ({"queries": 513}, "513 queries wanted, shapes have 512"),
    ],
)
def test_impossible_samplers_are_refused(random_shapes, change, message):
    arguments = {"points": N, "batch": 4, "settings_mix": {"clean": 1}, "seed": 0, "queries": 64}
    with pytest.raises(ValueError, match=message):
        TrainingSampler(random_shapes, **(arguments | change))


def test_speed(random_shapes):
    """150 pairs of 512 points per second of one core; some ten times that is usual."""
    fast = TrainingSampler(random_shapes, 512, 16, dict.fromkeys(SETTINGS, 1.0), 0, 512, True)
    fast.batch(0)
    start = time.process_time()
    for index in range(1, 21):
        fast.batch(index)
    assert 320 / (time.process_time() - start) > 150
