"""A training run's configuration: one TOML file, checked key by key."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

from vnreg_train.networks.config import NetworkConfig

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

CONFIG_FOLDER = Path(__file__).resolve().parent.parent / "configs"


@dataclass(frozen=True)
class DataConfig:
    """What a batch holds."""

    folder: str = "data/furniture"
    points: int = 1024
    surface_points: int = 0  # only so many of each shape's, the same ones always; 0 = all
    queries: int = 2048
    # Neighbours at this density; 0 = the network's. Half the points and half the neighbours cover
    # the same surface, so a network trained on 512 points with 10 runs on 1,024 with 20.
    neighbours: int = 0
    anisotropic: bool = False  # random scale per axis
    diagonal_crops: float = 0.5  # share of the crops along +-(1, 1, 1); others: any direction
    settings: dict[str, float] = field(default_factory=lambda: {"independent": 1.0})


@dataclass(frozen=True)
class OptimisationConfig:
    """AdamW on a one-cycle schedule with clipped gradients and an average of the weights."""

    steps: int = 10_000
    batch: int = 16
    learning_rate: float = 2e-3
    weight_decay: float = 1e-4
    warmup: float = 0.05  # share of the steps in which the rate rises
    clip_norm: float = 1.0
    ema_decay: float = 0.999
    bfloat16: bool = True  # autocast of the networks; poses stay in float64


@dataclass(frozen=True)
class StageConfig(OptimisationConfig):
    """One stage of the paper's network; the defaults are the paper's."""

    steps: int = 300_000
    batch: int = 32
    learning_rate: float = 1e-4
    weight_decay: float = 1e-3
    bfloat16: bool = False
    registration_weight: float = 10.0
    occupancy_weight: float = 0.1  # of the sum over 2,048 queries
    centred_occupancy: bool = True  # ours; False: the decoder sees each cloud where it stands
    consistency_weight: float = 0.0  # ours: whitened distance of the paired global features
    scaled_start: bool = False  # ours: initial weights scaled on data
    gradient_limit: float = 0.0  # ours: largest gradient of one pair's Procrustes; 0 = none
    unrolled: int = 0  # ours: up to so many iterations, drawn evenly, come before the trained ones
    tested_share: float = 0.0  # ours: share of the pairs matched between points kept as at test
    matching_weight: float = 1.0  # of the fine register's losses


@dataclass(frozen=True)
class RunConfig:
    """What every run has: its name, its machine, when it saves, logs and validates."""

    name: str = "unnamed"
    seed: int = 0
    threads: int = 2
    compile: bool = True
    checkpoint_minutes: float = 5.0
    log_steps: int = 20  # between two points of a curve
    validation_steps: int = 500  # between two validations; 0 = none
    validation_shapes: int = 32  # spread over the validation split


@dataclass(frozen=True)
class TrainingConfig(RunConfig):
    """The whole file."""

    device: str = "cpu"  # of torch: cpu, cuda, cuda:1
    network: NetworkConfig = field(default_factory=NetworkConfig)
    data: DataConfig = field(default_factory=DataConfig)
    coarse: StageConfig = field(default_factory=StageConfig)
    fine: StageConfig = field(default_factory=StageConfig)
    joint: StageConfig = field(default_factory=StageConfig)  # ours: everything at once, at last


SECTIONS = {"data": DataConfig, "coarse": StageConfig, "fine": StageConfig, "joint": StageConfig}

T = TypeVar("T")


def checked_section(kind: type[T], name: str, values: dict[str, Any]) -> T:
    """The dataclass `kind` of a TOML table; unknown keys are an error that names the known ones."""
    known = {f.name for f in fields(kind)}  # type: ignore[arg-type]  # T is a dataclass
    unknown = sorted(set(values) - known)
    if unknown:
        raise ValueError(f"[{name}]: unknown keys {unknown}; known: {sorted(known)}")
    return kind(**values)


def parse_config(text: str) -> TrainingConfig:
    """Reads TOML text; every unknown section or key is an error that names the known ones."""
    values = tomllib.loads(text)
    values["network"] = NetworkConfig.from_dict(values.get("network", {}))
    for name, kind in SECTIONS.items():
        values[name] = checked_section(kind, name, values.get(name, {}))
    return checked_section(TrainingConfig, "top level", values)


def find_config(path: str | Path) -> Path:
    """A file, or a shipped configuration by its bare name (`small`, `paper`, `vnreg`)."""
    path = Path(path)
    if not path.suffix and not path.exists():
        path = CONFIG_FOLDER / f"{path}.toml"
    if not path.exists():
        shipped = sorted(p.stem for p in CONFIG_FOLDER.glob("*.toml"))
        raise FileNotFoundError(f"{path}: no such configuration; shipped ones: {shipped}")
    return path


def config_arch(path: str | Path) -> str:
    """Which network a configuration is for: `paper`, or what its key `arch` says."""
    return str(tomllib.loads(find_config(path).read_text(encoding="utf-8")).get("arch", "paper"))


def load_config(path: str | Path) -> TrainingConfig:
    """Reads a configuration of the paper's network."""
    return parse_config(find_config(path).read_text(encoding="utf-8"))
