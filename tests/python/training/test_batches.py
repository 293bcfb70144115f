"""Training pairs in network coordinates: the truth that comes with a batch is the truth."""

from __future__ import annotations

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from vnreg_train.training.batches import Batch, make_batch


def sample() -> dict[str, np.ndarray]:
    """Two pairs of identical clouds in different order, queries on the clouds' own points."""
    rng = np.random.default_rng(0)
    source = rng.normal(size=(2, 40, 3)).astype(np.float32)
    return {
        "source": source,
        "target": source[:, :30],
        "queries": source[:, :5],
        "occupancies": np.ones((2, 5), np.float32),
    }


def made(apart: bool) -> Batch:
    rng = np.random.default_rng(1)
    turns = [Rotation.random(2, rng=rng).as_matrix() for _ in range(2)]
    # Cut to the target's length afterwards: clouds of a batch have equally many points.
    clouds = sample()
    clouds["source"] = np.concatenate([clouds["source"][:, :20], clouds["source"][:, 30:]], axis=1)
    return make_batch(clouds, 4, 0.33, turns[0], turns[1] if apart else None)


def test_shared_points_coincide_at_the_true_pose() -> None:
    for apart in (False, True):
        batch = made(apart)
        source, target = batch.points.chunk(2)
        assert torch.allclose(batch.at_truth(source)[:, :20], target[:, :20], atol=1e-5)


def test_queries_lie_on_the_points_they_were_taken_from() -> None:
    for apart in (False, True):
        batch = made(apart)
        assert batch.queries is not None
        assert torch.allclose(batch.queries, batch.points[:, :5], atol=1e-5)


def test_the_true_pose_leaves_no_residual() -> None:
    batch = made(True)
    assert batch.rotation is not None
    rotation, translation = batch.residual(batch.rotation, batch.translation)
    assert torch.allclose(rotation, torch.eye(3).expand(2, 3, 3), atol=1e-6)
    assert float(translation.abs().max()) == 0
    vectors = torch.eye(3).expand(2, 3, 3)
    assert torch.allclose(batch.turned(vectors), batch.rotation)


def test_queries_that_are_not_centred_meet_the_features_where_the_cloud_stands() -> None:
    """As in the authors' code: the target's translation moves its features, not its queries."""
    clouds = sample()
    clouds["source"] = clouds["source"][:, :30] + 0.5
    turns = Rotation.random(2, rng=np.random.default_rng(1)).as_matrix()
    moves = np.array([[0.1, 0.2, 0.3], [0.0, -0.4, 0.0]])
    centred = make_batch(clouds, 4, 0.33, apart=turns)
    plain = make_batch(clouds, 4, 0.33, apart=turns, moves=moves)
    assert centred.places is None and plain.places is not None
    assert centred.queries is not None and plain.queries is not None
    assert torch.equal(centred.edges, plain.edges)
    # A query and a feature keep their offset, but for the target's move.
    offset = plain.places.unsqueeze(1) - plain.queries + centred.queries
    assert torch.allclose(offset[:2], torch.zeros(2, 5, 3), atol=1e-5)
    lengths = offset[2:].norm(dim=2) / torch.from_numpy(np.linalg.norm(moves, axis=1))[:, None]
    assert torch.allclose(lengths, lengths[:, :1].expand(2, 5), rtol=1e-4)  # one scale a pair
    assert float(lengths.min()) > 0.1
