"""Hyper-parameters of the network `vnreg`, as configurations and model files store them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any


@dataclass(frozen=True)
class DescriptorConfig:
    """Widths and radii. Lengths are in network coordinates: the larger r.m.s. radius is 1."""

    channels: int = 32  # C: vector channels
    scalars: int = 48  # H: scalar channels
    gates: int = 8  # K: scalar-weighted offsets that a neighbourhood layer collects
    products: int = 4  # P: learned vectors that channels are multiplied with to give invariants
    local_descriptor: int = 32
    context_descriptor: int = 48
    frames: int = 8  # F: equivariant vectors per point, once local and once with context
    global_channels: int = 16  # G: rows of the global feature
    local_blocks: int = 2  # behind the first neighbourhood layer
    context_blocks: int = 3  # pooled, behind the second neighbourhood layer
    moment_radii: tuple[float, float, float] = (0.25, 0.5, 1.0)
    neighbourhood_radii: tuple[float, float] = (0.5, 0.8)

    @staticmethod
    def from_dict(values: dict[str, Any]) -> DescriptorConfig:
        """Builds a configuration from a TOML table; unknown keys are an error."""
        known = {field.name for field in fields(DescriptorConfig)}
        unknown = sorted(set(values) - known)
        if unknown:
            raise ValueError(f"[network]: unknown keys {unknown}; known: {sorted(known)}")
        listed: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in values.items()
        }
        return DescriptorConfig(**listed)

    def to_dict(self) -> dict[str, Any]:
        """The inverse of `from_dict`."""
        return asdict(self)
