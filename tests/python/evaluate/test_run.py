"""Answers are kept, and made again only where they are not there."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shipped import SHIPPED

from vnreg_train.evaluate.methods import EngineMethod
from vnreg_train.evaluate.rows import ROWS, select_rows
from vnreg_train.evaluate.run import Pairing, answer_all, answers, answers_path, read_answers

ROW = ROWS["P1/noise_0.01"]
ERRORS = {index: float(index) for index in range(6)}


@pytest.fixture
def pairing(data_folder: Path) -> Pairing:
    return Pairing("validation", data=data_folder)


def poses(estimates: list[Any]) -> Any:
    return np.stack([estimate.T_target_source for estimate in estimates])


def test_a_second_call_reads_what_the_first_wrote(
    pairing: Pairing, known_method: Any, tmp_path: Path
) -> None:
    first = known_method(ERRORS)
    written = answers(first, ROW, pairing, tmp_path)
    second = known_method(ERRORS)
    read = answers(second, ROW, pairing, tmp_path)
    assert (first.calls, second.calls) == (6, 0)
    np.testing.assert_array_equal(poses(read), poses(written))
    assert [estimate.evidence for estimate in read] == [e.evidence for e in written]


@pytest.mark.parametrize("torn", [1, 40, 400])
def test_an_interrupted_run_goes_on(
    pairing: Pairing, known_method: Any, tmp_path: Path, torn: int
) -> None:
    written = answers(known_method(ERRORS), ROW, pairing, tmp_path)
    path = answers_path(tmp_path, "verified", ROW)
    content = path.read_text(encoding="utf-8")
    third = [k for k, c in enumerate(content) if c == "\n"][3]
    path.write_text(content[: third + torn], encoding="utf-8")
    again = known_method(ERRORS)
    np.testing.assert_array_equal(poses(answers(again, ROW, pairing, tmp_path)), poses(written))
    assert again.calls == 3
    assert len(read_answers(path)[1]) == 6
    assert path.read_text(encoding="utf-8") == content


def test_more_shapes_add_to_the_answers(
    pairing: Pairing, known_method: Any, data_folder: Path, tmp_path: Path
) -> None:
    few = known_method(ERRORS)
    answers(few, ROW, Pairing("validation", 2, data=data_folder), tmp_path)
    every = known_method(ERRORS)
    answers(every, ROW, pairing, tmp_path)
    assert (few.calls, every.calls) == (2, 4)


def test_answers_of_another_version_split_or_seed_are_not_used(
    pairing: Pairing, known_method: Any, data_folder: Path, tmp_path: Path
) -> None:
    answers(known_method(ERRORS), ROW, pairing, tmp_path)
    for method, other in (
        (known_method(ERRORS, version=2), pairing),
        (known_method(ERRORS, version=2), Pairing("test", data=data_folder)),
        (known_method(ERRORS, version=2), Pairing("test", seed=1, data=data_folder)),
    ):
        answers(method, ROW, other, tmp_path)
        assert method.calls == 6


def test_processes_give_the_same_answers(pairing: Pairing, tmp_path: Path) -> None:
    makers = [partial(EngineMethod, "coarse", SHIPPED)]
    rows = select_rows(["P0/clean/45", "P1/independent"])
    alone = list(answer_all(makers, rows, pairing))
    together = list(answer_all(makers, rows, pairing, tmp_path, jobs=2))
    assert [(name, row.name) for name, row, _ in alone] == [
        ("coarse", "P0/clean/45"),
        ("coarse", "P1/independent"),
    ]
    for (_, row, one), (_, other_row, two) in zip(alone, together, strict=True):
        assert row == other_row
        np.testing.assert_array_equal(poses(one), poses(two))
