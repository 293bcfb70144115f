"""`make paper`: all its parts in order, every command one that the trainer knows."""

from __future__ import annotations

import shlex
import subprocess
from pathlib import Path

import pytest

from vnreg_train.cli import parser
from vnreg_train.paper.extrapolate import SPEED
from vnreg_train.paper.training_speed import RECIPES
from vnreg_train.training.config import load_config

ROOT = Path(__file__).resolve().parents[3]
PARTS = [
    "build-data",
    "train",
    "train",
    "train",
    "export",
    "export",
    "export",
    "evaluate",
    "paper-recall",
    "evaluate",
    "paper-recall",
    "paper-iterations",
    "paper-ablation",
    "paper-speed",
    "paper-training-speed",
    "paper-page",
]


def trainer_calls(budget: str) -> list[list[str]]:
    """The words of every call of the trainer that `make paper` would make."""
    command = ["make", "--dry-run", "--always-make", "paper", f"PAPER_BUDGET={budget}"]
    found = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    lines = found.stdout.replace("\\\n", " ").splitlines()
    marker = "-m vnreg_train.cli "
    return [shlex.split(line.split(marker)[1]) for line in lines if marker in line]


@pytest.mark.parametrize("budget", ["full", "smoke"])
def test_the_parts_come_in_order(budget: str) -> None:
    calls = trainer_calls(budget)
    assert [call[0] for call in calls] == PARTS
    for call in calls:
        assert callable(parser().parse_args(call).run_command)


def test_the_small_budget_touches_neither_page_nor_test_shapes() -> None:
    for name, *words in trainer_calls("smoke"):
        if name != "build-data":
            assert any("runs/paper-smoke" in word for word in words), name
            assert not any(word.startswith("docs/paper") for word in words)
        if "--split" in words:
            assert words[words.index("--split") + 1] == "validation"
    config = load_config("smoke")
    assert config.coarse.steps * config.coarse.batch <= 100


def test_the_small_budget_times_what_the_page_asks_for() -> None:
    """The page's words name the speed of two of the recipes."""
    call = next(words for words in trainer_calls("smoke") if words[0] == "paper-training-speed")
    lines = parser().parse_args(call).lines
    titles = {RECIPES[number - 1].title for number in lines}
    assert {SPEED, SPEED.removesuffix(", bf16")} <= titles


def test_an_unknown_budget_is_refused() -> None:
    run = subprocess.run(
        ["make", "-n", "paper", "PAPER_BUDGET=typo"], cwd=ROOT, capture_output=True, text=True
    )
    assert run.returncode != 0 and "PAPER_BUDGET is full or smoke, not typo" in run.stderr
