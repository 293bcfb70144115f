"""The pipeline in torch, stage by stage, as docs/design.md names the stages.

This is what the engine is compared with. It favours plainness over speed, and shares no code with
the engine: neighbours by full sort, pooled concatenations written out, batch norms not folded.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.edges import edge_vectors, neighbour_mean
from vnreg_train.networks.fine import gather_points
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.networks.vn import with_pooled
from vnreg_train.training.batches import network_scale

Stages = dict[str, NDArray[Any]]


def homogeneous(rotation: Tensor, translation: Tensor) -> NDArray[np.float64]:
    """(1, 3, 3), (1, 3) -> 4x4."""
    pose = np.eye(4)
    pose[:3, :3] = rotation[0].double().numpy()
    pose[:3, 3] = translation[0].double().numpy()
    return pose


class Reference:
    """Registers one pair at a time with the weights of a network, in the given precision."""

    def __init__(self, network: RegistrationNetwork, dtype: torch.dtype = torch.float32) -> None:
        self.network = network.to(dtype).eval()
        self.dtype = dtype

    @torch.no_grad()
    def register(self, source: NDArray[np.floating], target: NDArray[np.floating]) -> Stages:
        """Clouds (N, 3), (M, 3) in any units -> every stage; `T_target_source` in those units."""
        config = self.network.config
        x, y = (np.asarray(cloud, dtype=np.float64) for cloud in (source, target))
        centre_x, centre_y = x.mean(0), y.mean(0)
        x, y = x - centre_x, y - centre_y
        scale = float(network_scale(x[None], y[None], config.input_rms_radius)[0])
        stages: Stages = {}
        kept = {}
        features = {}
        points = {}
        for side, cloud in (("source", x), ("target", y)):
            # The cast to float32 is part of the definition, whatever the precision here.
            points[side] = torch.from_numpy((cloud / scale).astype(np.float32))[None].to(self.dtype)
            activations, features[side], kept[side] = self._encode(points[side])
            stages |= {f"{side}.{name}": _array(value) for name, value in activations.items()}
        coarse = procrustes(
            *(torch.from_numpy(stages[f"{side}.global"])[None] for side in ("source", "target"))
        )
        stages["coarse.T"] = homogeneous(*coarse)
        moved = points["source"] @ coarse[0].transpose(1, 2) + coarse[1].unsqueeze(1)
        steps = self.network.fine.run(
            gather_points(moved, kept["source"]),
            gather_points(points["target"], kept["target"]),
            gather_points(features["source"], kept["source"]),
            gather_points(features["target"], kept["target"]),
        )
        pose = stages["coarse.T"]
        for index, step in enumerate(steps):
            pose = homogeneous(step.rotation, step.translation) @ stages["coarse.T"]
            stages[f"fine.{index}.similarity"] = _array(step.similarity)
            stages[f"fine.{index}.match"] = _array(step.match)
            stages[f"fine.{index}.weight"] = _array(step.weight)
            stages[f"fine.{index}.T"] = pose
        stages["T_target_source"] = to_user_units(pose, centre_x, centre_y, scale)
        return stages

    def _encode(self, points: Tensor) -> tuple[dict[str, Tensor], Tensor, Tensor]:
        """Activations of one cloud (1, N, 3) in the layout (…, channels, 3), descriptors, kept."""
        extractor = self.network.extractor
        module, local = extractor.global_module, extractor.local_module
        edges = edge_vectors(points, neighbour_mean(points, self.network.config.neighbours))
        activations = {"points": points, "edge": edges.transpose(-1, -2)}
        v = module.pre(edges)
        for index, block in enumerate(module.network0):
            v = block(v if index == 0 else with_pooled(v))
            activations[f"network0.block{index}"] = v.transpose(-1, -2)
        latent = v
        v = module.network1[0](with_pooled(latent))
        activations["network1.block0"] = v.transpose(-1, -2)
        v = module.network1[1](with_pooled(v))
        feature = module.global_fc(module.global_relu(v.mean(1, keepdim=True))).squeeze(1)
        activations["global"] = feature.transpose(-1, -2)
        if extractor.local_encoder is not None:
            latent, feature = extractor.local_encoder(edges)
        expanded = feature.unsqueeze(1).expand_as(latent)
        v = local.network2[0](torch.cat([latent, expanded], dim=-1))
        activations["network2.block0"] = v.transpose(-1, -2)
        v = local.network2[1](with_pooled(v))
        activations["network2.block1"] = v.transpose(-1, -2)
        activations["frame"] = local.frame(v).transpose(-1, -2)
        descriptors = local.describe(v)
        activations["descriptor"] = descriptors
        activations["significance"], kept = self.network.fine.keep(descriptors)
        activations["kept"] = kept
        return activations, descriptors, kept


def _array(value: Tensor) -> NDArray[Any]:
    array = value[0].numpy()
    return array.astype(np.int32) if array.dtype == np.int64 else np.ascontiguousarray(array)


def to_user_units(
    pose: NDArray[np.float64],
    centre_source: NDArray[np.float64],
    centre_target: NDArray[np.float64],
    scale: float,
) -> NDArray[np.float64]:
    """From network coordinates (clouds centred and divided by `scale`) to the input's."""
    result = pose.copy()
    result[:3, 3] = centre_target + scale * pose[:3, 3] - pose[:3, :3] @ centre_source
    return result
