"""From sampled pairs to network coordinates: what one training step sees.

The clouds of a pair come in one common frame, so the true rotation is the identity. The encoder and
the coarse register are exactly equivariant, so a rotation would change no loss of the first stage.
The fine register sees directions in the target's frame; the second stage turns each pair at random.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from vnreg_train.data.resample import TrainingSampler
from vnreg_train.networks.edges import edge_vectors, neighbour_mean_kdtree


@dataclass
class Batch:
    """Clouds stacked source first, then target, in network coordinates (docs/design.md)."""

    points: Tensor  # (2B, N, 3), each cloud about its own centroid
    edges: Tensor  # (2B, N, 3, 3)
    queries: Tensor | None  # (2B, Q, 3); None where the shapes have no labels
    occupancies: Tensor | None  # (2B, Q)
    translation: Tensor  # (B, 3): target = source + translation, in network coordinates


def network_scale(
    source: NDArray[np.floating], target: NDArray[np.floating], rms_radius: float
) -> NDArray[np.float64]:
    """The common scale of centred clouds (B, N, 3), (B, M, 3): (B,). 1 where rms_radius is 0."""
    if rms_radius == 0:
        return np.ones(len(source))
    radii = [
        np.sqrt(np.square(cloud, dtype=np.float64).sum(2).mean(1)) for cloud in (source, target)
    ]
    return np.asarray(np.maximum(*radii) / rms_radius)


def make_batch(
    sample: dict[str, NDArray[np.float32]],
    neighbours: int,
    rms_radius: float,
    rotation: NDArray[np.float64] | None = None,
) -> Batch:
    """Centres, scales, optionally turns each pair by `rotation` (B, 3, 3), and finds the edges."""
    clouds = {k: np.asarray(v, dtype=np.float64) for k, v in sample.items() if k != "occupancies"}
    if rotation is not None:
        clouds = {k: v @ rotation.transpose(0, 2, 1) for k, v in clouds.items()}
    centre_s, centre_t = (clouds[k].mean(1, keepdims=True) for k in ("source", "target"))
    x, y = clouds["source"] - centre_s, clouds["target"] - centre_t
    scale = network_scale(x, y, rms_radius)[:, None, None]
    points = np.concatenate([x / scale, y / scale]).astype(np.float32)
    means = torch.from_numpy(neighbour_mean_kdtree(points, neighbours))
    queries = occupancies = None
    if "queries" in clouds:
        centred = np.concatenate([(clouds["queries"] - c) / scale for c in (centre_s, centre_t)])
        queries = torch.from_numpy(centred.astype(np.float32))
        occupancies = torch.from_numpy(np.tile(sample["occupancies"], (2, 1)).astype(np.float32))
    return Batch(
        points=torch.from_numpy(points),
        edges=edge_vectors(torch.from_numpy(points), means),
        queries=queries,
        occupancies=occupancies,
        translation=torch.from_numpy(((centre_s - centre_t) / scale)[:, 0].astype(np.float32)),
    )


class BatchSequence(Dataset[Batch]):
    """Batch i is a pure function of (seed, i): a resumed run sees what an unbroken one would."""

    def __init__(
        self, sampler: TrainingSampler, neighbours: int, rms_radius: float, turn: bool, steps: int
    ) -> None:
        self.sampler = sampler
        self.neighbours = neighbours
        self.rms_radius = rms_radius
        self.turn = turn
        self.steps = steps

    def __len__(self) -> int:
        return self.steps

    def __getitem__(self, index: int) -> Batch:
        sample = self.sampler.batch(index)
        rotation = None
        if self.turn:
            rng = np.random.default_rng([self.sampler.seed, index, 1])
            rotation = Rotation.random(len(sample["source"]), rng=rng).as_matrix()
        return make_batch(sample, self.neighbours, self.rms_radius, rotation)

    def loader(self, start: int) -> DataLoader[Batch]:
        """Batches start, start + 1, … made by one worker process ahead of the training."""
        return DataLoader(
            self,
            batch_size=None,
            sampler=range(start, self.steps),
            num_workers=1,
            prefetch_factor=4,
        )
