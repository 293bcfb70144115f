"""The network `vnreg` in torch, stage by stage, as docs/design.md names the stages.

What the engine is compared with. Which points are encoded is the engine's choice: an input here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.descriptor import DescriptorNetwork, StageEnd, input_features
from vnreg_train.training.batches import network_scale

Stages = dict[str, NDArray[Any]]
Indices = NDArray[np.integer[Any]]


class DescriptorReference:
    """Describes one pair at a time with the weights of a network, in the given precision."""

    def __init__(self, network: DescriptorNetwork, dtype: torch.dtype = torch.float64) -> None:
        self.network = network.to(dtype).eval()
        self.dtype = dtype

    @torch.no_grad()
    def describe(
        self,
        source: NDArray[np.floating],
        target: NDArray[np.floating],
        encoded: tuple[Indices, Indices],
    ) -> Stages:
        """Clouds (N, 3), (M, 3) in any units -> every stage of both, and `coarse.T`."""
        clouds = [np.asarray(cloud, dtype=np.float64) for cloud in (source, target)]
        clouds = [cloud - cloud.mean(0) for cloud in clouds]
        scale = float(network_scale(clouds[0][None], clouds[1][None], 1.0)[0])
        stages: Stages = {}
        for side, cloud, chosen in zip(("source", "target"), clouds, encoded, strict=True):
            # The cast to float32 is part of the definition, whatever the precision here.
            points = torch.from_numpy((cloud / scale).astype(np.float32))[None].to(self.dtype)
            stages |= {f"{side}.{k}": _array(v) for k, v in self._describe(points, chosen).items()}
        rows = [torch.from_numpy(stages[f"{s}.global"])[None] for s in ("source", "target")]
        rotation, translation = procrustes(*rows)
        stages["coarse.T"] = np.eye(4)
        stages["coarse.T"][:3, :3] = rotation[0].numpy()
        stages["coarse.T"][:3, 3] = translation[0].numpy()
        return stages

    def _describe(self, points: Tensor, encoded: Indices) -> dict[str, Tensor]:
        """Activations of one cloud (1, N, 3), vectors in the layout (…, channels, 3)."""
        chosen = torch.from_numpy(np.asarray(encoded, dtype=np.int64))
        others = torch.ones(points.shape[1], dtype=torch.bool)
        others[chosen] = False
        ordered = torch.cat([points[:, chosen], points[:, others]], dim=1)
        network, mask = self.network, torch.ones_like(ordered[..., 0])
        inputs = input_features(ordered, mask, len(chosen), network.config.moment_radii)
        centres = ordered[:, : len(chosen)]
        point = StageEnd(*network.point_stage(inputs))
        local = StageEnd(*network.local_stage(centres, *point))
        context = StageEnd(*network.context_stage(centres, inputs, *local))
        features = network.heads(centres, local, context)
        stages = {
            "points": points,
            "moments.scalars": inputs.scalars,
            "moments.local": inputs.local.transpose(2, 3),
            "moments.context": inputs.context.transpose(2, 3),
            "descriptor.local": features.local,
            "descriptor.context": features.context,
            "significance": features.significance,
            "overlap": features.overlap,
            "frames.local": features.frames_local.transpose(2, 3),
            "frames.context": features.frames_context.transpose(2, 3),
            "global": features.global_feature.transpose(1, 2),
        }
        for name, end in (("point", point), ("local", local), ("context", context)):
            stages |= {f"{name}.v": end.v.transpose(2, 3), f"{name}.z": end.z}
        return stages


def _array(value: Tensor) -> NDArray[Any]:
    return np.ascontiguousarray(value[0].numpy())
