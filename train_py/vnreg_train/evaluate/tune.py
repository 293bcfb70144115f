"""Chooses each peer's settings: every point of its grid on the same validation pairs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vnreg_train.evaluate.peers import PEERS, PeerMethod, Settings
from vnreg_train.evaluate.rows import ROWS
from vnreg_train.evaluate.run import Pairing, answers
from vnreg_train.evaluate.scores import score
from vnreg_train.evaluate.symmetry import SymmetryGroup

# One easy row, the two samplings, and the middle one of those with a bar.
TUNING_ROWS = ("P0/partial/180", "P1/independent", "P1/noise_0.01", "P1/partial_75_noise_0.01")


def tune_peers(
    names: Sequence[str], pairing: Pairing, groups: Mapping[str, SymmetryGroup], out: Path
) -> None:
    """Writes the file that peers.tuned_peer reads.

    Peers that are not named keep their entries. Settings that were tried before on the same pairs
    are not tried again: a grid can be extended.
    """
    about = {
        "rebuild": "vnreg-train tune-peers",
        "chosen_by": "mean recall over the rows at 5 deg and 0.2 up to symmetry, then by time",
        "split": pairing.split,
        "shapes": pairing.shapes,
        "seed": pairing.seed,
        "rows": list(TUNING_ROWS),
    }
    before: dict[str, Any] = {"peers": {}}
    if out.exists():
        before = json.loads(out.read_text(encoding="utf-8"))
    peers = before["peers"]
    for name in names:
        same = all(before.get(key) == value for key, value in about.items())
        known = peers.get(name, {}).get("tried", []) if same else []
        peers[name] = tuned_entry(name, pairing, groups, known)
        out.write_text(json.dumps({**about, "peers": peers}, indent=1) + "\n", encoding="utf-8")


def tuned_entry(
    name: str,
    pairing: Pairing,
    groups: Mapping[str, SymmetryGroup],
    known: Sequence[dict[str, Any]] = (),
) -> dict[str, Any]:
    """All that was tried for one peer, its grid and what is known already, and the best of it."""
    tried = list(known)
    for settings in PEERS[name].settings():
        if not any(one["settings"] == settings for one in known):
            tried.append(_tried(name, settings, pairing, groups))
    best = max(tried, key=lambda t: (round(t["mean_recall"], 6), -t["ms"]))
    print(name, best, flush=True)
    return {"chosen": best["settings"], "mean_recall": best["mean_recall"], "tried": tried}


def _tried(
    name: str, settings: Settings, pairing: Pairing, groups: Mapping[str, SymmetryGroup]
) -> dict[str, Any]:
    method = PeerMethod(name, settings)
    scores = [
        score(list(pairing.pairs(ROWS[row])), answers(method, ROWS[row], pairing), groups)
        for row in TUNING_ROWS
    ]
    recalls = [float(part.symmetric().mean()) for part in scores]
    return {
        "settings": dict(settings),
        "recall": [round(value, 4) for value in recalls],
        "mean_recall": float(np.mean(recalls)),
        "ms": round(float(np.median(np.concatenate([part.ms for part in scores]))), 1),
    }
