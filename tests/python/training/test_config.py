"""Configurations: the shipped ones load, and mistakes are named."""

from __future__ import annotations

from pathlib import Path

import pytest

from vnreg_train.networks.config import NetworkConfig
from vnreg_train.training.config import load_config, parse_config


def test_paper_configuration_is_the_papers() -> None:
    config = load_config("paper")
    assert config.network == NetworkConfig()
    assert config.network.global_channels == 128 and config.network.neighbours == 20
    assert config.data.points == 1024 and config.data.queries == 2048
    assert config.coarse.batch == 32 and config.coarse.learning_rate == 1e-4
    assert config.coarse.consistency_weight == 0 and config.coarse.gradient_limit == 0


def test_small_configuration_differs_in_width_only() -> None:
    small, paper = load_config("small").network, load_config("paper").network
    same = ("neighbours", "fine_iterations", "keep_divisor", "vector_neurons", "invariant_layer")
    assert all(getattr(small, name) == getattr(paper, name) for name in same)
    assert small.global_channels < paper.global_channels


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("nmae = 'x'", "nmae"),
        ("[network]\nglobal_chanels = 3", "global_chanels"),
        ("[data]\npoint = 3", "point"),
        ("[coarse]\nlr = 1.0", "lr"),
    ],
)
def test_unknown_keys_are_named(text: str, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        parse_config(text)


def test_a_missing_file_lists_the_shipped_ones() -> None:
    with pytest.raises(FileNotFoundError, match="small"):
        load_config("no-such-configuration")
    with pytest.raises(FileNotFoundError):
        load_config(Path("nowhere.toml"))
