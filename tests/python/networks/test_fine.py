"""The fine register's rules: which points are kept, how weights are made, what the losses label."""

from __future__ import annotations

import numpy as np
import torch

from vnreg_train.networks.config import NetworkConfig
from vnreg_train.networks.fine import (
    FineRegister,
    fine_loss,
    negative_entropy,
    significant_candidates,
    training_candidates,
)

CONFIG = NetworkConfig(descriptor_channels=8, pair_channels=6, significance_channels=(5, 4))


def test_keeps_the_top_sixth_in_descending_order() -> None:
    torch.manual_seed(0)
    fine = FineRegister(CONFIG).eval()
    score, kept = fine.keep(torch.randn(2, 100, 8))
    assert kept.shape == (2, 16)
    for row, index in zip(score, kept, strict=True):
        expected = np.argsort(-row.detach().numpy(), kind="stable")[:16]
        assert index.tolist() == expected.tolist()


def test_weights_below_the_median_are_zero_and_the_rest_sum_to_one() -> None:
    torch.manual_seed(1)
    fine = FineRegister(CONFIG).eval()
    x, y, fx, fy = (
        torch.randn(1, 10, 3),
        torch.randn(1, 7, 3),
        torch.randn(1, 10, 8),
        torch.randn(1, 7, 8),
    )
    with torch.no_grad():
        step = fine.run(x, y, fx, fy)[0]
    assert step.similarity.shape == (1, 10, 7)
    assert (
        int((step.weight > 0).sum()) == 6
    )  # ten weights, lower median: five and the median itself
    assert abs(float(step.weight.sum()) - 1) < 1e-6


def test_split_algebra_equals_the_concatenation() -> None:
    """The paper's pair layer takes [F_i; F_j; distance; direction] of every pair."""
    torch.manual_seed(5)
    fine = FineRegister(CONFIG).double().eval()
    x, y, fx, fy = (
        torch.randn(1, n, c, dtype=torch.float64) for n, c in ((9, 3), (7, 3), (9, 8), (7, 8))
    )
    difference = x.unsqueeze(2) - y.unsqueeze(1)
    distance = difference.norm(dim=-1, keepdim=True)
    shape = (1, 9, 7, 8)
    pairs = [
        fx.unsqueeze(2).expand(shape),
        fy.unsqueeze(1).expand(shape),
        distance,
        difference / distance,
    ]
    features = fine.pair(torch.cat(pairs, dim=-1))
    similarity, row_maxima = fine.compare(x, y, *fine.feature_parts(fx, fy))
    assert torch.allclose(similarity, fine.similarity(features).squeeze(-1), atol=1e-9)
    assert torch.allclose(row_maxima, features.amax(2), atol=1e-9)


def test_poses_accumulate() -> None:
    """The last step's pose moves the source to where the iterations left it."""
    torch.manual_seed(2)
    fine = FineRegister(CONFIG).eval()
    x, y, fx, fy = (torch.randn(1, 12, n) for n in (3, 3, 8, 8))
    with torch.no_grad():
        steps = fine.run(x, y, fx, fy)
        moved, parts = x, fine.feature_parts(fx, fy)
        for _ in range(3):
            _, r, t = fine.step(moved, y, *parts)
            moved = moved @ r.transpose(1, 2) + t.unsqueeze(1)
    last = steps[-1]
    assert torch.allclose(x @ last.rotation.transpose(1, 2) + last.translation, moved, atol=1e-5)


def test_half_of_the_candidates_have_a_true_match() -> None:
    rng = np.random.default_rng(0)
    source = torch.from_numpy(rng.uniform(-1, 1, (4, 300, 3)).astype(np.float32))
    target = source[:, :150]  # half of the points coincide, the rest are far with high probability
    index, nearest, is_match = training_candidates(source, target, 40)
    assert index.shape == nearest.shape == is_match.shape == (4, 40)
    assert bool((is_match[:, :20] == 1).all()) and bool((is_match[:, 20:] == 0).all())
    distance = (
        torch.gather(source, 1, index.unsqueeze(-1).expand(-1, -1, 3))
        - torch.gather(target, 1, nearest.unsqueeze(-1).expand(-1, -1, 3))
    ).norm(dim=-1)
    assert bool((distance[:, :20] < 0.05).all()) and bool((distance[:, 20:] >= 0.05).all())


def test_the_truth_of_kept_points_is_the_nearest_kept_one_if_near() -> None:
    source = torch.tensor([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]])
    target = torch.tensor([[[3.01, 0, 0], [2.04, 0, 0], [1.0, 0, 0], [1.96, 0, 0]]])
    kept_source, kept_target = torch.tensor([[3, 2, 1]]), torch.tensor([[1, 0]])
    truth, has_match = significant_candidates(source, target, kept_source, kept_target)
    assert truth.tolist() == [[1, 0, -1]]
    assert has_match.tolist() == [[1.0, 1.0, 0.0]]


def test_points_without_a_match_do_not_count_as_matched() -> None:
    """A truth of -1 takes no part in the matching loss, and its weight must learn to vanish."""
    torch.manual_seed(5)
    fine = FineRegister(CONFIG).eval()
    x, features = torch.randn(1, 9, 3), torch.randn(1, 9, 8)
    with torch.no_grad():
        steps = fine.run(x, x, features, features)
    score, truth = torch.zeros(1, 9), torch.arange(9).unsqueeze(0)
    lonely = torch.where(truth == 4, -1, truth)
    is_match = (lonely >= 0).float()
    for step in steps:
        step.similarity = 40 * torch.eye(9).unsqueeze(0) - 20
        step.match = truth
        step.weight_logit = torch.full((1, 9), 20.0)
    terms = fine_loss(steps, score, score, is_match, lonely)
    assert float(terms["match"]) < 1e-6
    assert abs(float(terms["weight"]) - len(steps) * 20.0 / 9) < 1e-3


def test_losses_vanish_for_a_perfect_matcher() -> None:
    torch.manual_seed(3)
    fine = FineRegister(CONFIG).eval()
    x = torch.randn(1, 9, 3)
    with torch.no_grad():
        steps = fine.run(x, x, torch.randn(1, 9, 8), torch.randn(1, 9, 8))
    for step in steps:
        step.similarity = 40 * torch.eye(9).unsqueeze(0) - 20
        step.match = torch.arange(9).unsqueeze(0)
        step.weight_logit = torch.full((1, 9), 20.0)
    entropy = negative_entropy(steps[0].similarity, -1)
    terms = fine_loss(steps, entropy, entropy, torch.ones(1, 9))
    assert all(float(value) < 1e-6 for value in terms.values())


def test_the_loss_reaches_every_parameter() -> None:
    torch.manual_seed(4)
    fine = FineRegister(CONFIG)
    fx, fy = torch.randn(2, 20, 8), torch.randn(2, 20, 8)
    steps = fine.run(torch.randn(2, 20, 3), torch.randn(2, 20, 3), fx, fy)
    scores = (fine.significance(f).squeeze(-1) for f in (fx, fy))
    # To mypy a sum may be the int that it starts from.
    sum(fine_loss(steps, *scores, torch.ones(2, 20)).values()).backward()  # type: ignore[union-attr]
    for name, parameter in fine.named_parameters():
        assert parameter.grad is not None and float(parameter.grad.abs().sum()) > 0, name
