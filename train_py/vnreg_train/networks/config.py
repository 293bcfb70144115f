"""Hyper-parameters of the paper's network, as configurations and model files store them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any


@dataclass(frozen=True)
class NetworkConfig:
    """Widths, neighbourhood size and ablation switches. The defaults are the paper's."""

    global_channels: int = 128  # C: vector channels of the latent and the global feature
    local_channels: int = 64  # L: vector channels of the local module
    descriptor_channels: int = 64  # D: length of the invariant descriptor F^L
    pair_channels: int = 32  # P: channels of the pair features of the fine register
    significance_channels: tuple[int, int] = (64, 32)
    neighbours: int = 20  # k, the point itself included
    shared_direction: bool = False  # one VN-ReLU direction for all channels
    fine_iterations: int = 3
    keep_divisor: int = 6  # hard elimination keeps N // keep_divisor points
    input_rms_radius: float = 0.0  # common r.m.s. radius of the input; 0 = coordinates as given
    decoder_width: int = 256
    # Ablations of the paper's Table V. The engine needs vector neurons.
    vector_neurons: bool = True
    invariant_layer: bool = True
    shared_encoder: bool = True
    weighted_centroids: bool = True  # in the fine register's covariance too; torch only

    @property
    def equivariant(self) -> bool:
        """Whether global features turn with the cloud and descriptors do not change."""
        return self.vector_neurons and self.invariant_layer

    @staticmethod
    def from_dict(values: dict[str, Any]) -> NetworkConfig:
        """Builds a configuration from a TOML table; unknown keys are an error."""
        known = {field.name for field in fields(NetworkConfig)}
        unknown = sorted(set(values) - known)
        if unknown:
            raise ValueError(f"[network]: unknown keys {unknown}; known: {sorted(known)}")
        values = dict(values)
        if "significance_channels" in values:
            first, second = values["significance_channels"]
            values["significance_channels"] = (int(first), int(second))
        return NetworkConfig(**values)

    def to_dict(self) -> dict[str, Any]:
        """The inverse of `from_dict`."""
        return asdict(self)
