"""A training run of the network `vnreg`: one TOML file with `arch = "vnreg"`."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

from vnreg_train.networks.descriptor_config import DescriptorConfig
from vnreg_train.training.config import (
    OptimisationConfig,
    RunConfig,
    checked_section,
    find_config,
)

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@dataclass(frozen=True)
class MixtureConfig:
    """What a batch holds."""

    folder: str = "data/furniture"
    points: int = 1024  # the most a cloud has
    encoded: int = 384  # of them, those the network describes; every cloud must have as many
    # Share of the steps in which shapes get random proportions: the last ones see them as they are.
    anisotropic_share: float = 1.0
    mixture: dict[str, float] = field(default_factory=lambda: {"partial_75": 1.0})


@dataclass(frozen=True)
class DescriptorOptimisationConfig(OptimisationConfig):
    """And the weight of each loss (descriptor_losses)."""

    weights: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class DescriptorTrainingConfig(RunConfig):
    """The whole file."""

    arch: str = "vnreg"
    name: str = "vnreg"
    threads: int = 1
    checkpoint_minutes: float = 2.0
    network: DescriptorConfig = field(default_factory=DescriptorConfig)
    data: MixtureConfig = field(default_factory=MixtureConfig)
    optimisation: DescriptorOptimisationConfig = field(default_factory=DescriptorOptimisationConfig)


def parse_descriptor_config(text: str) -> DescriptorTrainingConfig:
    """Reads TOML text; every unknown section or key is an error that names the known ones."""
    values = tomllib.loads(text)
    if values.get("arch") != "vnreg":
        raise ValueError(f"arch: expected 'vnreg', got {values.get('arch')!r}")
    values["network"] = DescriptorConfig.from_dict(values.get("network", {}))
    values["data"] = checked_section(MixtureConfig, "data", values.get("data", {}))
    values["optimisation"] = checked_section(
        DescriptorOptimisationConfig, "optimisation", values.get("optimisation", {})
    )
    return checked_section(DescriptorTrainingConfig, "top level", values)


def load_descriptor_config(path: str | Path) -> DescriptorTrainingConfig:
    """Reads a file, or a shipped configuration by its bare name."""
    return parse_descriptor_config(find_config(path).read_text(encoding="utf-8"))
