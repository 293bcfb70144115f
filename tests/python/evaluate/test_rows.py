"""Names of rows and patterns of them."""

from __future__ import annotations

import pytest

from vnreg_train.evaluate.rows import BAR_ROWS, P1_FACTORS, ROWS, VIEW_FACTORS, select_rows


def names(*patterns: str) -> list[str]:
    return [row.name for row in select_rows(patterns)]


def test_the_paper_has_sixteen_rows_and_every_factor_one() -> None:
    assert len(ROWS) == 16 + len(P1_FACTORS) + len(VIEW_FACTORS)
    assert len(names("p0")) == 16
    assert names("P1") == [f"P1/{name}" for name in P1_FACTORS]
    assert names("views") == [f"views/{name}" for name in VIEW_FACTORS]
    assert set(names("all")) == set(ROWS)
    assert set(names("bars")) == set(BAR_ROWS)


def test_wildcards_and_order() -> None:
    assert names("P0/*/180") == [
        "P0/clean/180",
        "P0/noisy/180",
        "P0/independent/180",
        "P0/partial/180",
    ]
    assert names("p1/all", "p0/clean/45", "P1/all") == ["P0/clean/45", "P1/all"]


def test_a_pattern_that_names_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="no row is called 'P2'.*P0/clean/45"):
        select_rows(["p0", "P2"])
