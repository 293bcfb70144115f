"""Every stage in torch, from the inputs that the engine recorded for it.

Comparing whole pipelines mixes a stage's own rounding with what it inherits: behind
ill-conditioned weights two correct float32 programs drift apart. Here each stage starts from the
engine's own inputs, so what differs is that stage alone.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from vnreg_train.export.reference import homogeneous
from vnreg_train.networks.coarse import procrustes
from vnreg_train.networks.edges import edge_vectors, neighbour_mean
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.networks.vn import with_pooled

Stages = Mapping[str, NDArray[np.generic]]


class StageRecomputation:
    """Stages of a float32 network in evaluation mode, each from the engine's recorded inputs."""

    def __init__(self, network: RegistrationNetwork, recorded: Stages) -> None:
        self.network = network
        self.recorded = recorded

    @torch.no_grad()
    def all(self) -> dict[str, NDArray[np.generic]]:
        """What torch makes of the inputs, under the engine's names; `points` is an input."""
        stages: dict[str, NDArray[np.generic]] = {}
        for side in ("source", "target"):
            values = self._encode(side) | self._describe(side)
            stages |= {f"{side}.{name}": value[0].numpy() for name, value in values.items()}
        stages["coarse.T"] = homogeneous(
            *procrustes(self._tensor("source.global"), self._tensor("target.global"))
        )
        for index in range(self.network.config.fine_iterations):
            stages |= self._fine_step(index)
        return stages

    def _tensor(self, name: str) -> Tensor:
        return torch.from_numpy(np.asarray(self.recorded[name], dtype=np.float32))[None]

    def _vectors(self, name: str) -> Tensor:
        """A vector feature in torch's layout, channels last."""
        return self._tensor(name).transpose(-1, -2)

    def _encode(self, side: str) -> dict[str, Tensor]:
        module = self.network.extractor.global_module
        points = self._tensor(f"{side}.points")
        edges = edge_vectors(points, neighbour_mean(points, self.network.config.neighbours))
        block0, block1, latent = (self._vectors(f"{side}.network0.block{i}") for i in range(3))
        vectors = {
            "edge": edges,
            "network0.block0": module.network0[0](module.pre(self._vectors(f"{side}.edge"))),
            "network0.block1": module.network0[1](with_pooled(block0)),
            "network0.block2": module.network0[2](with_pooled(block1)),
            "network1.block0": module.network1[0](with_pooled(latent)),
        }
        last = module.network1[1](with_pooled(self._vectors(f"{side}.network1.block0")))
        pooled = last.mean(1, keepdim=True)
        vectors["global"] = module.global_fc(module.global_relu(pooled)).squeeze(1)
        return {name: value.transpose(-1, -2) for name, value in vectors.items()}

    def _describe(self, side: str) -> dict[str, Tensor]:
        local = self.network.extractor.local_module
        latent, feature = (self._vectors(f"{side}.{n}") for n in ("network0.block2", "global"))
        own_encoder = self.network.extractor.local_encoder
        if own_encoder is not None:  # of which nothing is recorded
            latent, feature = own_encoder(self._vectors(f"{side}.edge"))
        expanded = feature.unsqueeze(1).expand_as(latent)
        v = self._vectors(f"{side}.network2.block1")
        products = v.transpose(-1, -2) @ self._vectors(f"{side}.frame")
        z = local.descriptor(products.flatten(-2))
        score, _ = self.network.fine.keep(self._tensor(f"{side}.descriptor"))
        block0 = local.network2[0](torch.cat([latent, expanded], dim=-1))
        block1 = local.network2[1](with_pooled(self._vectors(f"{side}.network2.block0")))
        return {
            "network2.block0": block0.transpose(-1, -2),
            "network2.block1": block1.transpose(-1, -2),
            "frame": local.frame(v).transpose(-1, -2),
            "descriptor": torch.relu(local.norm(z.transpose(1, 2)).transpose(1, 2)),
            "significance": score,
            # Of the engine's significances: nearly equal ones of torch may come in another order.
            "kept": self.network.fine.most_significant(self._tensor(f"{side}.significance")),
        }

    def _kept(self, side: str, name: str) -> Tensor:
        return self._tensor(f"{side}.{name}")[:, self.recorded[f"{side}.kept"].astype(np.int64)]

    def _fine_step(self, index: int) -> dict[str, NDArray[np.generic]]:
        name = f"fine.{index}"
        previous = self.recorded["coarse.T" if index == 0 else f"fine.{index - 1}.T"]
        pose = torch.from_numpy(np.asarray(previous, dtype=np.float32))
        moved = self._kept("source", "points") @ pose[:3, :3].T + pose[:3, 3]
        target = self._kept("target", "points")
        descriptors = (self._kept(side, "descriptor") for side in ("source", "target"))
        parts = self.network.fine.feature_parts(*descriptors)
        step, _, _ = self.network.fine.step(moved, target, *parts)
        match = torch.from_numpy(self.recorded[f"{name}.match"].astype(np.int64))
        rotation, translation = procrustes(moved, target[:, match], self._tensor(f"{name}.weight"))
        return {
            f"{name}.similarity": step.similarity[0].numpy(),
            f"{name}.match": step.match[0].numpy(),
            f"{name}.weight": step.weight[0].numpy(),
            f"{name}.T": homogeneous(rotation, translation) @ previous,
        }
