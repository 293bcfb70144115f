"""Engine against torch, end to end: the pose, and how often a discrete choice falls otherwise."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from parity_pairs import (
    make_test_pair,
    rotation_difference_deg,
    same_choices,
    worst_determination,
)
from parity_twin import REPORTS, Twin

SIZES = (64, 333, 768, 1024)
MAX_ROTATION_DEG = 0.01
MAX_SHARE = 0.01
# Below it the matches lie on a line or collapse, and rounding turns the fitted rotation at will.
DETERMINED = 1e-3


def compare(model: Twin, pairs: int) -> dict[str, Any]:
    """Clean and noisy pairs of all sizes in turn."""
    differing = undetermined = 0
    rotations: list[float] = []
    for seed in range(pairs):
        size = SIZES[seed % len(SIZES)]
        other = SIZES[(seed // 8) % len(SIZES)] if seed % 16 >= 8 else size
        pair = make_test_pair(1000 + seed, size, other, noisy=seed % 8 >= 4)
        engine = model.engine(pair.source, pair.target)
        torch32 = model.reference(pair.source, pair.target)
        if not same_choices(engine, torch32):
            differing += 1
        elif worst_determination(engine) < DETERMINED:
            undetermined += 1
        else:
            rotations.append(
                rotation_difference_deg(engine["T_target_source"], torch32["T_target_source"])
            )
    return {
        "pairs": pairs,
        "pairs_with_differing_choices": differing,
        "share": differing / pairs,
        "pairs_with_undetermined_rotation": undetermined,
        "pairs_compared": len(rotations),
        "largest_rotation_difference_deg": max(rotations),
    }


@pytest.mark.parametrize(("name", "pairs"), [("shipped", 320), ("paper", 64)])
def test_poses_agree_wherever_the_choices_do(
    name: str, pairs: int, twin: Callable[[str], Twin]
) -> None:
    figures = compare(twin(name), pairs)
    REPORTS.mkdir(parents=True, exist_ok=True)
    path = REPORTS / "parity.json"
    report = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    path.write_text(json.dumps(report | {name: figures}, indent=1) + "\n", encoding="utf-8")
    assert figures["largest_rotation_difference_deg"] <= MAX_ROTATION_DEG
    assert figures["share"] < MAX_SHARE
