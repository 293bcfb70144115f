"""Same pairs, time and recall: the engine's modes beside other registration programs.

The peers, their settings (tuned on validation pairs) and the scoring are those of `make evaluate`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vnreg_bench.inputs import SHIPPED
from vnreg_bench.machine import pin
from vnreg_bench.settings import ROOT, Settings
from vnreg_train.data.protocol import Pair
from vnreg_train.evaluate.estimates import Estimate
from vnreg_train.evaluate.measures import share
from vnreg_train.evaluate.methods import EngineMethod, Method
from vnreg_train.evaluate.pairs import make_pairs
from vnreg_train.evaluate.peers import PEERS, tuned_peer
from vnreg_train.evaluate.scores import Bools, score
from vnreg_train.evaluate.symmetry import SYMMETRIES, read_symmetries

SPLIT = "validation"
# Finds a pose near a given one; the others find any.
LOCAL = "small_gicp"


def methods() -> list[Method]:
    """Each on one thread."""
    return [
        EngineMethod("verified", SHIPPED["vnreg"]),
        EngineMethod("paper", SHIPPED["small"]),
        *(tuned_peer(name) for name in PEERS),
    ]


def peers(settings: Settings) -> dict[str, Any]:
    """Per row and method: milliseconds (processor time, median) and recall up to symmetry within 5
    degrees and 0.2. Every pair meets all methods, one after the other, before the next pair."""
    pin(1)
    contestants = methods()
    rows = {}
    for row in settings.peer_rows:
        pairs = make_pairs(SPLIT, row, settings.peer_shapes, data=settings.data)
        for method in contestants:
            method.estimate(pairs[0])  # first calls load and allocate
        answers = [[method.estimate(pair) for method in contestants] for pair in pairs]
        rows[row] = {
            method.name: {
                **share(right_up_to_symmetry(pairs, estimates)),
                "ms": float(np.median([e.ms for e in estimates])),
                "ms_p95": float(np.quantile([e.ms for e in estimates], 0.95)),
            }
            for method, estimates in zip(contestants, zip(*answers, strict=True), strict=True)
        }
    return {"split": SPLIT, "shapes": settings.peer_shapes, "rows": rows}


def right_up_to_symmetry(pairs: Sequence[Pair], estimates: Sequence[Estimate]) -> Bools:
    """Which answers are within 5 degrees and 0.2 of a pose that is right."""
    return score(pairs, estimates, read_symmetries(ROOT / SYMMETRIES)).symmetric()
