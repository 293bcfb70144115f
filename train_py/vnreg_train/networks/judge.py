"""The judge: the log-odds that a pose is right, from what both clouds show around their points.

The engine computes the inputs (docs/design.md, "The judge") and records them as the stages
`judge.inputs` and `judge.fit`; here is only what is learned.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

POINT_INPUTS = 33
# Points of each cloud: of every pose, and of the best few between which it is hard to choose.
FIRST_POINTS = 64
MOST_POINTS = 256
# Columns of the point inputs that the pose is told too.
SPACING = 30
NOISE = (28, 29)


class JudgeNetwork(nn.Module):
    """Two layers for every point, their mean, two layers for the pose."""

    mean: Tensor
    scale: Tensor

    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(POINT_INPUTS))
        self.register_buffer("scale", torch.ones(POINT_INPUTS))
        self.point0 = nn.Linear(POINT_INPUTS, hidden)
        self.point1 = nn.Linear(hidden, hidden)
        self.pose0 = nn.Linear(hidden + 3, hidden)
        self.pose1 = nn.Linear(hidden, 1)

    @torch.no_grad()
    def fit_inputs(self, points: Tensor) -> None:
        """Sets mean and scale so that inputs (N, 33) have mean 0 and spread 1."""
        self.mean.copy_(points.mean(0))
        self.scale.copy_(1 / (points.std(0) + 1e-3))

    def forward(self, points: Tensor, fit: Tensor) -> Tensor:
        """points (..., P, 33), score of the fit (...) -> log-odds (...)."""
        hidden = torch.relu(self.point0((points - self.mean) * self.scale))
        hidden = torch.relu(self.point1(hidden)).mean(-2)
        # Equal for all points but the sides of the noise: of the first point, a source point.
        pair = points[..., 0, :]
        noise = (pair[..., NOISE[0]] + pair[..., NOISE[1]]) / 2
        rest = torch.stack([fit, pair[..., SPACING], noise], -1)
        hidden = torch.relu(self.pose0(torch.cat([hidden, rest], -1)))
        return self.pose1(hidden).squeeze(-1)

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """Under the names of docs/design.md; mean and scale folded into the first layer."""
        weight = self.point0.weight * self.scale
        named = {
            "judge.point.0.weight": weight,
            "judge.point.0.bias": self.point0.bias - weight @ self.mean,
            "judge.point.1.weight": self.point1.weight,
            "judge.point.1.bias": self.point1.bias,
            "judge.pose.0.weight": self.pose0.weight,
            "judge.pose.0.bias": self.pose0.bias,
            "judge.pose.1.weight": self.pose1.weight,
            "judge.pose.1.bias": self.pose1.bias,
        }
        return {name: tensor.detach().numpy().astype(np.float32) for name, tensor in named.items()}

    @classmethod
    def from_tensors(cls, tensors: dict[str, NDArray[np.float32]]) -> JudgeNetwork:
        """The network whose tensors these are, with mean 0 and scale 1."""
        network = cls(len(tensors["judge.point.1.bias"]))
        layers = {
            "judge.point.0": network.point0,
            "judge.point.1": network.point1,
            "judge.pose.0": network.pose0,
            "judge.pose.1": network.pose1,
        }
        with torch.no_grad():
            for name, layer in layers.items():
                layer.weight.copy_(torch.from_numpy(tensors[f"{name}.weight"]))
                layer.bias.copy_(torch.from_numpy(tensors[f"{name}.bias"]))
        return network
