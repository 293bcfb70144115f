"""The gallery of the worst pairs: one HTML file with a still of each and the viewer on click."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

import vnreg
from vnreg_train.data.mesh import Float64
from vnreg_train.evaluate.methods import Mode
from vnreg_train.evaluate.thumbnail import thumbnail
from vnreg_train.evaluate.worst_pairs import WrongAnswer

PAGE = Path(__file__).with_name("gallery.html")
SAME_POSE = 1e-6  # largest difference of an entry between two runs of one engine


@dataclass(frozen=True)
class Card:
    """One pair of the gallery. facts: what is said of it, in words; data: for the viewer."""

    title: str
    row: str
    category: str
    kind: str
    facts: Mapping[str, str]
    picture: str
    data: str


def make_card(wrong: WrongAnswer, registrar: vnreg.Registrar, model: str, mode: Mode) -> Card:
    """Aligns the pair once more, to show how the engine came to its pose.

    The still and the facts are of the run's answer; where this engine gives another pose, the card
    says so.
    """
    pair = wrong.pair
    result = registrar.align(pair.source, pair.target)
    view = vnreg.view(
        pair.source,
        pair.target,
        result,
        registrar.explain(),
        source_name=f"{pair.name}, source",
        target_name=f"{pair.name}, target",
        model=model,
        mode=mode,
    )
    return Card(
        title=_short_name(pair.name),
        row=wrong.row.name,
        category=wrong.category,
        kind=wrong.kind,
        facts=_facts(wrong, result),
        picture=_picture(wrong),
        data=view.data,
    )


def _short_name(path: str) -> str:
    """`archive/model/model.obj` by its file's name."""
    return Path(path).stem.replace("_", " ")


def _facts(wrong: WrongAnswer, result: vnreg.Result) -> dict[str, str]:
    scores, estimate = wrong.scores, wrong.estimate
    facts = {"status": estimate.status}
    if np.isfinite(estimate.confidence):
        facts["confidence"] = f"{estimate.confidence:.2f}"
    if estimate.T_target_source is not None:
        facts["rotation error"] = f"{scores.symmetric_rotation_deg[0]:.1f}°"
        facts["translation error"] = f"{scores.symmetric_translation[0]:.3f}"
    facts |= {
        "true overlap": f"{wrong.pair.overlap:.2f}",
        "points": f"{len(wrong.pair.source):,} onto {len(wrong.pair.target):,}",
        "right alternative": "listed" if scores.right_alternative[0] else "none",
        "pair": f"{wrong.split} {wrong.pair.shape}, seed {wrong.seed}",
    }
    if not _same_pose(result, estimate.T_target_source):
        facts["this engine"] = _other_answer(wrong, result)
    return facts


def _same_pose(result: vnreg.Result, pose: Float64 | None) -> bool:
    if pose is None or not result.has_pose:
        return pose is None and not result.has_pose
    return float(np.abs(result.T_target_source - pose).max()) < SAME_POSE


def _other_answer(wrong: WrongAnswer, result: vnreg.Result) -> str:
    if not result.has_pose:
        return f"gives no pose ({result.status})"
    error, _ = wrong.group.errors(result.T_target_source, wrong.pair.T_target_source)
    return f"gives another pose, {error:.1f}° off ({result.status}, {result.confidence:.2f})"


def _picture(wrong: WrongAnswer) -> str:
    """The source where the answer has it, and where it belongs."""
    pair, found = wrong.pair, wrong.estimate.T_target_source
    source, truth = pair.source.astype(np.float64), pair.T_target_source
    poses = [("right", truth)]
    if found is not None:
        poses = [("as found", found), ("right", wrong.group.nearest(found, truth))]
    moved = [(name, source @ pose[:3, :3].T + pose[:3, 3]) for name, pose in poses]
    return thumbnail(pair.target.astype(np.float64), moved)


def gallery_page(cards: Sequence[Card], title: str, note: str) -> str:
    """The whole page. It asks nothing of a network; the viewer is in it once."""
    parts = {
        "title": escape(title),
        "note": escape(note),
        "cards": "\n".join(_card(number, card) for number, card in enumerate(cards)),
        "viewer": _for_script(vnreg.view_template()),
        "placeholder": _for_script(vnreg.VIEW_PLACEHOLDER),
    }
    page = PAGE.read_text(encoding="utf-8")
    pieces = page.split("{{")
    filled = [pieces[0]]
    for piece in pieces[1:]:
        name, rest = piece.split("}}", 1)
        filled += [parts[name], rest]
    return "".join(filled)


def _card(number: int, card: Card) -> str:
    facts = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in card.facts.items())
    return (
        f'<article data-row="{escape(card.row)}" data-kind="{escape(card.kind)}" '
        f'data-category="{escape(card.category)}">\n'
        f"<h2>{escape(card.title)}</h2>\n"
        f'<p class="where">{escape(card.row)} · {escape(card.category)} · '
        f"<strong>{escape(card.kind)}</strong></p>\n"
        f"{card.picture}\n<dl>{facts}</dl>\n"
        f'<button type="button" data-pair="pair-{number}">Open in 3D</button>\n'
        f'<script type="application/json" id="pair-{number}">{card.data}</script>\n</article>'
    )


def _for_script(text: str) -> str:
    """As a JSON string that may stand inside a script element."""
    return json.dumps(text).replace("<", "\\u003c")
