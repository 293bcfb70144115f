"""Pairs of different objects: how they are drawn, counted, and used to fit the confidence."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from shipped import SHIPPED

import vnreg
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.evaluate.calibrate import Sample, with_different_objects
from vnreg_train.evaluate.disjoint import (
    POINTS,
    DisjointReport,
    disjoint_answers,
    disjoint_report,
)
from vnreg_train.evaluate.run import Pairing


def test_a_pair_without_a_pose_counts_as_not_sure() -> None:
    report = DisjointReport(np.array([np.nan, 0.2, 0.6, 0.95]), Counter(ok=4))
    assert report.share_above(0.5) == 0.5
    assert report.share_above(0.9) == 0.25


def test_pairs_are_drawn_by_the_seed(shapes: ShapeSet) -> None:
    registrar = vnreg.Registrar(mode="coarse", threads=1)
    first, again, other = (
        [answer.result.T_target_source for answer in disjoint_answers(registrar, shapes, 3, seed)]
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_the_report_counts_every_pair(shapes: ShapeSet) -> None:
    registrar = vnreg.Registrar(threads=1)
    answers = list(disjoint_answers(registrar, shapes, 4))
    assert all(a.result.points_source == a.result.points_target == POINTS for a in answers)
    report = disjoint_report(answers)
    assert sum(report.statuses.values()) == len(report.confidence) == 4


@pytest.mark.parametrize("count", [1, 3])
def test_different_objects_are_wrong_poses_of_the_sample(data_folder: Path, count: int) -> None:
    names = vnreg.Registrar(threads=1).align(*np.random.default_rng(0).normal(size=(2, 90, 3)))
    keys = tuple(names.evidence)
    sample = Sample(keys, np.zeros((2, 8)), np.array([True, False]), np.zeros(2), np.ones(2))
    pairing = Pairing("validation", data=data_folder)
    joined = with_different_objects(sample, SHIPPED, pairing, count)
    assert joined.names == keys
    assert joined.evidence.shape == (2 + count, 8) and np.isfinite(joined.evidence).all()
    assert joined.right.tolist() == [True, False] + [False] * count
    assert np.isnan(joined.nees[2:]).all()
