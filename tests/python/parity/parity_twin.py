"""One model in both worlds: torch's network, and the engine that runs its exported file."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

import vnreg
from vnreg_train.export.reference import Reference
from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.registration import RegistrationNetwork

ROOT = Path(__file__).resolve().parents[3]
REPORTS = ROOT / "build" / "reports"
Stages = dict[str, NDArray[np.generic]]

CONFIGS = {
    "paper": NetworkConfig(),
    "paper-shared": NetworkConfig(shared_direction=True, fine_iterations=1),
    "small": NetworkConfig(
        global_channels=48, local_channels=32, shared_direction=True, input_rms_radius=0.33
    ),
    # 2C = L: the first block of the local module has no shortcut matrix.
    "identity-shortcut": NetworkConfig(
        global_channels=32, local_channels=64, neighbours=9, keep_divisor=3
    ),
    "narrow": NetworkConfig(
        global_channels=8,
        local_channels=12,
        descriptor_channels=5,
        pair_channels=3,
        significance_channels=(7, 2),
        neighbours=6,
        shared_direction=True,
        fine_iterations=2,
        keep_divisor=4,
        input_rms_radius=1.0,
    ),
}


@dataclass
class Twin:
    """One model, run by torch and by the engine."""

    name: str
    network: RegistrationNetwork
    path: Path
    max_points: int = 16384  # the memory that a registrar takes grows with its square

    def __post_init__(self) -> None:
        model = vnreg.Model.load(self.path)
        self._recorder = vnreg.Registrar(
            model, mode="paper", max_points=self.max_points, record_stages=True
        )
        self._reference = Reference(copy.deepcopy(self.network))
        self._exact = Reference(copy.deepcopy(self.network), torch.float64)

    def engine(self, source: NDArray[np.float64], target: NDArray[np.float64]) -> Stages:
        """Every stage, and T_target_source; the pair must have a pose."""
        result = self._recorder.align(source, target)
        assert result.has_pose, result
        return dict(self._recorder.stages()) | {"T_target_source": result.T_target_source}

    def reference(self, source: NDArray[np.float64], target: NDArray[np.float64]) -> Stages:
        """The same in torch, float32."""
        return self._reference.register(source, target)

    def exact(self, source: NDArray[np.float64], target: NDArray[np.float64]) -> Stages:
        """The same in torch, float64: the truth that both float32 programs round."""
        return self._exact.register(source, target)
