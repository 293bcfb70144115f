"""From sampled pairs to network coordinates: what one training step sees.

The clouds of a pair come in one common frame, so the true rotation is the identity. The encoder and
the coarse register are exactly equivariant, so a rotation would change no loss of the first stage.
The fine register sees directions in the target's frame; the second stage turns each pair at random.
Networks without vector neurons or invariant layer are not equivariant: they see the two clouds of a
pair turned apart, as the evaluation's pairs are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from vnreg_train.data.protocol import MAX_TRANSLATION, random_pose
from vnreg_train.data.resample import TrainingSampler
from vnreg_train.networks.edges import edge_vectors, neighbour_mean_kdtree


@dataclass
class Batch:
    """Clouds stacked source first, then target, in network coordinates (docs/design.md)."""

    points: Tensor  # (2B, N, 3), each cloud about its own centroid
    edges: Tensor  # (2B, N, 3, 3)
    queries: Tensor | None  # (2B, Q, 3); None where the shapes have no labels
    occupancies: Tensor | None  # (2B, Q)
    translation: Tensor  # (B, 3): target = rotation source + translation, network coordinates
    rotation: Tensor | None = None  # (B, 3, 3); None is the identity
    places: Tensor | None = None  # (2B, 3): where queries that are not centred see the features

    def to(self, device: torch.device) -> Batch:
        """The same batch there; itself where it is there already."""
        if self.points.device == device:
            return self
        moved: dict[str, Any] = {k: v.to(device) for k, v in vars(self).items() if v is not None}
        return replace(self, **moved)

    def residual(self, rotation: Tensor, translation: Tensor) -> tuple[Tensor, Tensor]:
        """What separates a pose from the true one: R_gt^T R (B, 3, 3) and t - t_gt (B, 3)."""
        turn = rotation if self.rotation is None else self.rotation.transpose(1, 2) @ rotation
        return turn, translation - self.translation

    def turned(self, vectors: Tensor) -> Tensor:
        """Source vectors (B, 3, C) in the target's frame."""
        return vectors if self.rotation is None else self.rotation @ vectors

    def at_truth(self, points: Tensor) -> Tensor:
        """Source points (B, N, 3) at the true pose."""
        turned = points if self.rotation is None else points @ self.rotation.transpose(1, 2)
        return turned + self.translation.unsqueeze(1)


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
    apart: NDArray[np.float64] | None = None,
    moves: NDArray[np.float64] | None = None,
) -> Batch:
    """Centres, scales and finds the edges.

    Optionally turns each pair by `rotation` and its target once more by `apart`, (B, 3, 3) both.
    moves: None, and queries are centred as their cloud is; or translations (B, 3) of the target,
    and queries stay in the shape's frame (the authors' code): features meet them where the cloud
    stands, the target's cloud moved and its queries not.
    """
    clouds = {k: np.asarray(v, dtype=np.float64) for k, v in sample.items() if k != "occupancies"}
    if rotation is not None:
        clouds = {k: v @ rotation.transpose(0, 2, 1) for k, v in clouds.items()}
    centre_s, centre_t = (clouds[k].mean(1, keepdims=True) for k in ("source", "target"))
    x, y = clouds["source"] - centre_s, clouds["target"] - centre_t
    scale = network_scale(x, y, rms_radius)[:, None, None]
    shift = (centre_s - centre_t) / scale
    if apart is not None:
        y, shift = y @ apart.transpose(0, 2, 1), shift @ apart.transpose(0, 2, 1)
    points = np.concatenate([x / scale, y / scale]).astype(np.float32)
    means = torch.from_numpy(neighbour_mean_kdtree(points, neighbours))
    queries = occupancies = places = None
    if "queries" in clouds:
        origins = (centre_s, centre_t) if moves is None else (0.0, 0.0)
        around_s, around_t = ((clouds["queries"] - origin) / scale for origin in origins)
        if apart is not None:
            around_t = around_t @ apart.transpose(0, 2, 1)
        if moves is not None:
            turned = centre_t if apart is None else centre_t @ apart.transpose(0, 2, 1)
            stand = np.concatenate([centre_s / scale, (turned + moves[:, None]) / scale])
            places = torch.from_numpy(stand[:, 0].astype(np.float32))
        queries = torch.from_numpy(np.concatenate([around_s, around_t]).astype(np.float32))
        occupancies = torch.from_numpy(np.tile(sample["occupancies"], (2, 1)).astype(np.float32))
    return Batch(
        points=torch.from_numpy(points),
        edges=edge_vectors(torch.from_numpy(points), means),
        queries=queries,
        occupancies=occupancies,
        translation=torch.from_numpy(shift[:, 0].astype(np.float32)),
        rotation=None if apart is None else torch.from_numpy(apart.astype(np.float32)),
        places=places,
    )


class BatchSequence(Dataset[Batch]):
    """Batch i is a pure function of (seed, i): a resumed run sees what an unbroken one would."""

    def __init__(
        self,
        sampler: TrainingSampler,
        neighbours: int,
        rms_radius: float,
        turn: bool,
        steps: int,
        apart: bool = False,
        move: bool = False,
    ) -> None:
        self.sampler = sampler
        self.neighbours = neighbours
        self.rms_radius = rms_radius
        self.turn = turn
        self.steps = steps
        self.apart = apart
        self.move = move

    def __len__(self) -> int:
        return self.steps

    def __getitem__(self, index: int) -> Batch:
        sample = self.sampler.batch(index)
        rng = np.random.default_rng([self.sampler.seed, index, 1])
        count = len(sample["source"])
        rotation = Rotation.random(count, rng=rng).as_matrix() if self.turn else None
        apart = None
        if self.apart:
            apart = np.stack([random_pose(rng, 180.0)[:3, :3] for _ in range(count)])
        moves = None
        if self.move:
            moves = rng.uniform(-MAX_TRANSLATION, MAX_TRANSLATION, (count, 3))
        return make_batch(sample, self.neighbours, self.rms_radius, rotation, apart, moves)

    def loader(self, start: int) -> DataLoader[Batch]:
        """Batches start, start + 1, … made by one worker process ahead of the training.

        Its generator is its own: a loader draws a number when it starts, and from torch's own
        generator a run that was stopped and went on would draw one more than an unbroken one.
        """
        return DataLoader(
            self,
            batch_size=None,
            sampler=range(start, self.steps),
            num_workers=1,
            prefetch_factor=4,
            generator=torch.Generator(),
        )
