"""The lines of the ablation: the paper's Table V, then our own additions, one at a time.

Each variant is one base configuration with a few values changed, so that nothing else differs.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from vnreg_train.training.config import TrainingConfig

FIXED_POINTS = 2048  # of each shape, that the authors' code draws once and for all
BASE = "shared"


@dataclass(frozen=True)
class Variant:
    """One line: what it changes of the base, and what the paper reports for it.

    changes: values by section of the configuration. trained_as: another variant whose checkpoint
    it evaluates. averaged: whether the averaged weights are taken. paper_recall in % (independent,
    180 degrees), paper_pairs_per_second on a Titan RTX.
    """

    title: str
    changes: dict[str, dict[str, Any]] = field(default_factory=dict)
    trained_as: str | None = None
    averaged: bool = True
    weighted_centroids: bool = True
    paper_recall: float | None = None
    paper_pairs_per_second: float | None = None


def _network(**switches: bool) -> dict[str, dict[str, Any]]:
    return {"network": dict(switches)}


VARIANTS = {
    "neither": Variant(
        "neither",
        _network(vector_neurons=False, invariant_layer=False, shared_encoder=False),
        paper_recall=17.9,
        paper_pairs_per_second=17.8,
    ),
    "invariant": Variant(
        "invariant layer only",
        _network(vector_neurons=False, shared_encoder=False),
        paper_recall=21.4,
        paper_pairs_per_second=17.8,
    ),
    "vectors": Variant(
        "vector neurons only",
        _network(invariant_layer=False, shared_encoder=False),
        paper_recall=73.2,
        paper_pairs_per_second=17.9,
    ),
    "both": Variant(
        "both",
        _network(shared_encoder=False),
        paper_recall=89.5,
        paper_pairs_per_second=17.8,
    ),
    BASE: Variant("both, shared encoder", paper_recall=90.2, paper_pairs_per_second=36.4),
    "fixed_samples": Variant(
        "without fresh resampling", {"data": {"surface_points": FIXED_POINTS}}
    ),
    "tested_candidates": Variant(
        "with candidates as at test time", {"fine": {"tested_share": 0.5}}
    ),
    "uncentred_occupancy": Variant(
        "without centred occupancy", {"coarse": {"centred_occupancy": False}}
    ),
    "last_weights": Variant("without averaged weights", trained_as=BASE, averaged=False),
    "plain_centroids": Variant(
        "without weighted centroids", trained_as=BASE, weighted_centroids=False
    ),
}


def variant_config(base: TrainingConfig, name: str) -> TrainingConfig:
    """The configuration that a variant is trained with."""
    config = replace(base, name=f"{base.name}-{name}")
    for section, changes in VARIANTS[name].changes.items():
        config = replace(config, **{section: replace(getattr(config, section), **changes)})
    return config
