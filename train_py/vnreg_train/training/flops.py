"""What a training step computes: the matrix products of its forward and backward pass, counted."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.utils.flop_counter import FlopCounterMode

from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.config import TrainingConfig


def pair_gflop(config: TrainingConfig, stage: str) -> float:
    """GFLOP (a multiplication and an addition are two) for one pair of a stage's training.

    As torch would execute it, uncompiled; what is not a matrix product is left out. Counted on
    tensors without data, so it takes no time to speak of, and draws no random numbers: the run
    that asks goes on with its own.
    """
    with torch.device("meta"):
        network = RegistrationNetwork(config.network)
    points = config.data.points
    edges = torch.zeros(2, points, 3, 3, device="meta")
    with FlopCounterMode(display=False) as counter:
        with torch.set_grad_enabled(stage != "fine"):
            latent, feature = network.encode(edges)
        results = [feature] if stage != "fine" else []
        if stage != "fine" and config.data.queries > 0:
            queries = torch.zeros(2, config.data.queries, 3, device="meta")
            results.append(network.decoder(queries, feature))
        if stage != "coarse":
            results += _matching(network, edges, latent, feature)
        torch.stack([result.sum() for result in results]).sum().backward()
    return float(counter.get_total_flops()) / 1e9


def _matching(
    network: RegistrationNetwork, edges: Tensor, latent: Tensor, feature: Tensor
) -> list[Tensor]:
    """What the losses of local module and fine register see, of one pair."""
    fine = network.fine
    descriptors = network.extractor.describe(edges, latent, feature)
    kept = descriptors[:, : descriptors.shape[1] // fine.keep_divisor]
    results = [fine.significance(kept)]
    parts = fine.feature_parts(*kept.chunk(2))
    for _ in range(fine.iterations):
        cloud = torch.zeros(1, kept.shape[1], 3, device="meta")
        similarity, row_maxima = fine.compare(cloud, cloud, *parts)
        results += [similarity, fine.weight(row_maxima)]
    return results
