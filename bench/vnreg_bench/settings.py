"""How long each part of a run may take."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Settings:
    """The defaults are those of `make bench`."""

    build: Path = ROOT / "build" / "release"
    data: Path = ROOT / "data" / "furniture"
    rounds: int = 31
    latency_pairs: int = 10_000
    sizes: tuple[int, ...] = (128, 256, 512, 1024, 2048, 4096, 8192, 16384)
    channels: tuple[int, ...] = (16, 32, 48, 64, 96, 128, 192, 256)
    threads: tuple[int, ...] = (1, 2)
    contest_networks: tuple[str, ...] = ("vnreg", "small", "paper")
    peer_shapes: int = 82
    peer_rows: tuple[str, ...] = ("P1/noise_0.01", "P1/partial_75_noise_0.01")
    kernel_repetitions: int = 7
    batch_pairs: int = 240
    batch_rounds: int = 5
    kernel_filter: str = "."

    def to_json(self) -> dict[str, Any]:
        """All but the folders."""
        return {k: v for k, v in asdict(self).items() if not isinstance(v, Path)}

    @staticmethod
    def quick(build: Path, data: Path) -> Settings:
        """A few minutes: fewer runs, sizes and pairs; every part takes part."""
        return Settings(
            build=build,
            data=data,
            rounds=9,
            latency_pairs=500,
            sizes=(128, 512, 1024, 4096),
            channels=(32, 128),
            contest_networks=("vnreg", "paper"),
            peer_shapes=60,
            peer_rows=("P1/noise_0.01",),
            kernel_repetitions=3,
            batch_pairs=80,
            batch_rounds=3,
        )
