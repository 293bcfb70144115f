"""What went wrong with the pairs that are not right, by what the wrong pose looks like.

Where `measures.failures` says at which step of the method a pair was lost, this says what a user
sees of it; by the category of the shape, as the catalog of the models has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vnreg_train.data.mesh import Int64
from vnreg_train.evaluate.measures import NEAR_DEG
from vnreg_train.evaluate.scores import Scores

FLIPPED_DEG = 165.0
LITTLE_OVERLAP = 0.5
SURE = 0.5
# In this order: a pair is of the first kind that fits.
KINDS = ("right", "no pose", "near miss", "twin", "flipped", "little overlap", "other")
MEANINGS = {
    "no pose": "the method gave none",
    "near miss": f"within {NEAR_DEG:g}° of a right pose",
    "twin": "lays the shape nearly where a right pose does, so that only details tell them apart",
    "flipped": f"turned by {FLIPPED_DEG:g}° or more",
    "little overlap": f"less than {LITTLE_OVERLAP:g} of the points have a counterpart",
    "other": "none of these",
}


def failure_kinds(scores: Scores) -> Int64:
    """Indices (N,) into KINDS; rotation errors are up to symmetry."""
    angle = scores.symmetric_rotation_deg
    fits = np.stack(
        [
            scores.symmetric(),
            ~np.isfinite(scores.translation),
            angle < NEAR_DEG,
            scores.twin,
            angle >= FLIPPED_DEG,
            scores.overlap < LITTLE_OVERLAP,
            np.ones(len(scores), bool),
        ]
    )
    return np.argmax(fits, axis=0)


def by_category(scores: Scores, categories: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Of each category its pairs, how many are of each kind, and how many wrong ones are sure.

    categories: of the pairs' shapes (N,). Sorted by name.
    """
    kinds, names = failure_kinds(scores), np.asarray(categories)
    sure = (kinds > 0) & (scores.confidence > SURE)  # NaN is not
    table: dict[str, dict[str, Any]] = {}
    for name in sorted(set(categories)):
        own = names == name
        counts = np.bincount(kinds[own], minlength=len(KINDS))
        table[name] = {
            "pairs": int(own.sum()),
            **{kind: int(n) for kind, n in zip(KINDS, counts, strict=True)},
            "sure": int(sure[own].sum()),
        }
    return table
