"""docs/results.md from a run's JSON (vnreg_train.evaluate.results)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from vnreg_train.data.protocol import ANGLES_DEG
from vnreg_train.evaluate.bars import LIMIT, METHOD, peer_gap, verdicts
from vnreg_train.evaluate.failure_kinds import KINDS, MEANINGS, SURE
from vnreg_train.evaluate.measures import NEAR_DEG, limit_name
from vnreg_train.evaluate.methods import MODES
from vnreg_train.evaluate.pairs import MAX_VIEW_ANGLE_DEG
from vnreg_train.evaluate.peers import PEERS
from vnreg_train.evaluate.rows import PAPER_SETTINGS
from vnreg_train.evaluate.scores import GROSS_DEG, LIMITS
from vnreg_train.evaluate.surface_evidence import TOLD
from vnreg_train.evaluate.titles import TITLES
from vnreg_train.evaluate.twins import NEAR
from vnreg_train.evaluate.twins import SHARE as TWIN_SHARE

Results = Mapping[str, Any]
# Recall in % at 45, 90, 135, 180 degrees (Lin et al., ICRA 2023, ModelNet40).
PAPER_RECALL = {
    "clean": (100.0, 100.0, 100.0, 100.0),
    "noisy": (98.8, 98.9, 98.8, 98.9),
    "independent": (90.6, 89.5, 89.9, 90.2),
    "partial": (82.1, 79.3, 78.0, 78.3),
}


def markdown(results: Results, plots: Sequence[tuple[str, str]], folder: str = "results") -> str:
    """The whole page; plots as (caption, file name) lie, like results.json, in `folder`."""
    parts = [
        "# Results",
        "Written by `make evaluate` from one run; the figures behind it, with seeds and versions: "
        f"[results.json]({folder}/results.json).",
        how_measured(results),
        "## The bars",
        bars_table(results),
        "## P0, the paper's protocol",
        p0_section(results),
        "## P1: disjoint samples, any rotation",
        p1_section(results),
        "## Views: what a depth camera sees",
        views_section(results),
        "## Recall against overlap",
        overlap_table(results),
        _picture(plots, "overlap.svg", folder),
        "## Recall against noise and angle",
        "Bars are 95 % Wilson intervals. An equivariant network asks nothing of the angle; what "
        "starts from a guess does.",
        _picture(plots, "noise.svg", folder),
        _picture(plots, "angle.svg", folder),
        "## Confidence and covariance",
        confidence_section(results),
        _picture(plots, "reliability.svg", folder),
        "## Where the failures of mode verified come from",
        failures_table(results),
        categories_section(results),
        _picture(plots, "categories.svg", folder),
        "## Time",
        time_table(results),
        "## Peers",
        peers_section(results),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _picture(plots: Sequence[tuple[str, str]], wanted: str, folder: str) -> str:
    found = [caption for caption, name in plots if name == wanted]
    return f"![{found[0]}]({folder}/{wanted})" if found else ""


def how_measured(results: Results) -> str:
    about, methods = results["about"], results["methods"]
    models = ", ".join(
        f"`{mode}` with model `{methods[mode]['model']}`" for mode in MODES if mode in methods
    )
    return (
        f"{about['shapes']} pairs a row, one per shape of the {about['split']} split, seed "
        f"{about['seed']}; through the Python module ({models}), one thread, {about['cpu']}. "
        "Recall in %: rotation error below 5° and translation error below 0.2 (longest side 1), "
        "with the 95 % Wilson interval. *Up to symmetry*: to the nearest pose that places the "
        f"shape alike; {about['symmetric_shapes']} of the shapes have such poses "
        "([symmetries](../data/symmetries/furniture.json): 99 % of the surface within 0.01 of the "
        "turned surface, both ways). Times are processor times on one thread."
    )


def bars_table(results: Results) -> str:
    lines = [
        [v.what, v.paper, f"**{v.measured}**", v.bar, _word(v.met), v.aim, _word(v.aim_met)]
        for v in verdicts(results)
    ]
    head = ["mode verified", "the paper", "measured", "bar", "", "aim", ""]
    return table(head, lines)


def _word(met: bool) -> str:
    return "met" if met else "missed"


def p0_section(results: Results) -> str:
    parts = [
        "Plain recall. The paper's own figures are for ModelNet40.",
        p0_table(results),
        "Partial, 180°, apart by whether both clouds were cropped towards the same side (the "
        "pairs then share nearly all points) or opposite ones (two thirds):",
        halves_table(results),
        "At 180°, plain recall at tighter limits, errors (median / 95th percentile) and gross "
        f"failures (rotation error above {GROSS_DEG:g}°):",
        errors_table(results, [f"P0/{setting}/180" for setting in PAPER_SETTINGS], "plain"),
    ]
    return "\n\n".join(parts)


def p0_table(results: Results) -> str:
    lines = []
    for setting in PAPER_SETTINGS:
        for method in _measured(results, [f"P0/{setting}/{angle}" for angle in ANGLES_DEG]):
            shares = [
                results["rows"].get(f"P0/{setting}/{angle}", {}).get(method) for angle in ANGLES_DEG
            ]
            cells = ["" if s is None else interval(s["plain"][LIMIT]) for s in shares]
            lines.append([setting, TITLES[method], *cells])
        lines.append([setting, "*the paper*", *(f"{x:g}" for x in PAPER_RECALL[setting])])
    return table(["setting", "method", *(f"θ = {angle}°" for angle in ANGLES_DEG)], lines)


def halves_table(results: Results) -> str:
    row = results["rows"].get("P0/partial/180", {})
    lines = [
        [TITLES[m], *(interval(row[m]["halves"][h]) for h in ("same", "opposite"))]
        for m in TITLES
        if m in row and set(row[m]["halves"]) == {"same", "opposite"}
    ]
    return table(["method", "same side", "opposite sides"], lines)


def p1_section(results: Results) -> str:
    rows = [name for name in results["rows"] if name.startswith("P1/")]
    parts = [
        "Each cloud has its own half of the shape's dense samples, is cropped by a plane of its "
        "own random direction (75 or 50 % of the surface kept) and thinned to 1,024 points; "
        "rotations uniform on SO(3). *density*: the target has 512 points. *uneven*: the density "
        "of each cloud falls tenfold along a random direction. *outliers*: a tenth of the points "
        "lies anywhere in the enlarged bounding box. *all*: 75 %, noise 0.01, 512 points, uneven "
        "and outliers together. Recall up to symmetry:",
        recall_table(results, rows, "symmetric"),
        "Plain recall of the same pairs:",
        recall_table(results, rows, "plain"),
        "Mode verified and the others at tighter limits, up to symmetry; errors and gross "
        "failures as above:",
        errors_table(results, rows, "symmetric"),
    ]
    return "\n\n".join(parts) if rows else ""


def views_section(results: Results) -> str:
    rows = [name for name in results["rows"] if name.startswith("views/")]
    parts = [
        "Clouds that show what one viewpoint sees, three longest sides away (hidden point removal, "
        "Katz et al. 2007), noise 0.005, up to 1,024 points. *scan_to_model*: a view onto a sample "
        "of the whole surface. *two_scans*: two views, up to "
        f"{MAX_VIEW_ANGLE_DEG:g}° apart. Up to symmetry:",
        recall_table(results, rows, "symmetric"),
        errors_table(results, rows, "symmetric"),
    ]
    return "\n\n".join(parts) if rows else ""


def recall_table(results: Results, rows: Sequence[str], kind: str) -> str:
    methods = _measured(results, rows)
    lines = []
    for row in rows:
        of = results["rows"][row]
        cells = [interval(of[m][kind][LIMIT]) if m in of else "" for m in methods]
        lines.append([_short(row), *cells])
    return table(["row", *(TITLES[m] for m in methods)], lines)


def errors_table(results: Results, rows: Sequence[str], kind: str) -> str:
    prefix = "" if kind == "plain" else "symmetric_"
    lines = []
    for row in rows:
        for method, figures in _of_row(results, row):
            lines.append(
                [
                    _short(row),
                    TITLES[method],
                    *(f"{100 * figures[kind][limit_name(x)]['recall']:.1f}" for x in LIMITS),
                    _pair(figures[prefix + "rotation_deg"], "{:.2f}°"),
                    _pair(figures[prefix + "translation"], "{:.4f}"),
                    f"{100 * figures[prefix + 'gross']['recall']:.1f}",
                ]
            )
    limits = [f"{rotation:g}°, {translation:g}" for rotation, translation in LIMITS]
    return table(["row", "method", *limits, "rotation", "translation", "gross %"], lines)


def overlap_table(results: Results) -> str:
    """Mode verified and the best of the rest over the cropped P1 rows."""
    rows = [r for r in results["rows"] if r.startswith("P1/partial")]
    methods = _measured(results, rows)
    bins = sorted(
        {
            (b["from"], b["to"])
            for r, m in _each(results, rows, methods)
            for b in _bins(results, r, m)
        }
    )
    lines = []
    for low, high in bins:
        cells = []
        for method in methods:
            found = [
                b
                for row in rows
                if method in results["rows"][row]
                for b in _bins(results, row, method)
                if b["from"] == low
            ]
            hits, pairs = sum(b["hits"] for b in found), sum(b["pairs"] for b in found)
            cells.append(f"{100 * hits / pairs:.1f}" if pairs else "")
        lines.append([f"{low:g}–{high:g}", str(pairs), *cells])
    note = (
        "The overlap of a pair is the share of both clouds' points that lie on the part of the "
        "surface which the other cloud's crop leaves. All cropped P1 rows but *all* together, "
        "recall up to symmetry:"
    )
    head = ["overlap", "pairs", *(TITLES[m] for m in methods)]
    return note + "\n\n" + table(head, lines) if lines else ""


def _each(results: Results, rows: Sequence[str], methods: Sequence[str]) -> list[tuple[str, str]]:
    return [(r, m) for r in rows for m in methods if m in results["rows"][r]]


def _bins(results: Results, row: str, method: str) -> list[dict[str, Any]]:
    bins: list[dict[str, Any]] = results["rows"][row][method]["by_overlap"]
    return bins


def confidence_section(results: Results) -> str:
    """Mode verified, per row and pooled."""
    lines = []
    found = [(_short(r), of[METHOD]) for r, of in results["rows"].items() if METHOD in of]
    found += [(f"**{p}**", f) for p, f in results["pooled"].get(METHOD, {}).items()]
    for name, figures in found:
        trust, spread = figures["confidence"], figures["nees"]
        lines.append(
            [
                name,
                _figure(trust and trust["auroc"], "{:.3f}"),
                _figure(trust and trust["ece"], "{:.3f}"),
                _figure(spread and spread["mean"], "{:.2f}"),
                _figure(spread and spread["median"], "{:.2f}"),
            ]
        )
    note = (
        "Of mode verified. AUROC and ECE (ten bins of equal width) of the confidence that a pose "
        "is right up to symmetry; a row without failures has no AUROC. The normalised estimation "
        "error squared e^T C^-1 e of right poses should be 6 in the mean (median 5.3)."
    )
    head = ["pairs", "AUROC", "ECE", "e^T C^-1 e, mean", "median"]
    return note + "\n\n" + table(head, lines)


def failures_table(results: Results) -> str:
    kinds = ("near", "alternative", "ambiguous", "wrong", "no_pose")
    lines = []
    for row, of in results["rows"].items():
        if METHOD in of:
            lost = of[METHOD]["failures"]
            lines.append(
                [
                    _short(row),
                    str(sum(lost[key] for key in kinds)),
                    *(str(lost[key]) for key in (*kinds, "twins", "untold")),
                ]
            )
    note = (
        "Each failure (up to symmetry) counts where it fits first: within "
        f"{NEAR_DEG:g}° of a right pose (lost by the refinement); a right pose among the "
        "alternatives (found, not chosen); called ambiguous without it; wrong and not said so (no "
        "right pose was found, or it was rejected early); no pose. *Twins* among all of these: "
        f"wrong poses that lay {TWIN_SHARE:.0%} of the shape's surface within {NEAR:g} of where "
        "the right one does, so that only details tell them apart. *Untold* among all of these: "
        "truly ambiguous pairs. One who knew the shape's exact surface, and let both poses settle "
        f"on it, would not put {math.exp(TOLD):.0f} to 1 on the right one by the target's points."
    )
    head = ["row", "failures", f"within {NEAR_DEG:g}°", "among alternatives", "ambiguous"]
    return note + "\n\n" + table([*head, "wrong", "no pose", "twins", "untold"], lines)


def categories_section(results: Results) -> str:
    """What the wrong poses look like, by the category of the shape; P1 and views together."""
    sums: dict[str, dict[str, int]] = {}
    for pool in ("P1", "views"):
        for category, counts in results["categories"].get(pool, {}).items():
            total = sums.setdefault(category, dict.fromkeys(counts, 0))
            for name, count in counts.items():
                total[name] += count
    if not sums:
        return ""
    sums["**all**"] = {
        name: sum(counts[name] for counts in sums.values()) for name in ("pairs", *KINDS, "sure")
    }
    lines = [
        [
            category,
            str(counts["pairs"]),
            f"{100 * (1 - counts['right'] / counts['pairs']):.1f}",
            *(str(counts[kind]) for kind in KINDS[1:]),
            str(counts["sure"]),
        ]
        for category, counts in sums.items()
    ]
    kinds = "; ".join(f"*{kind}*: {meaning}" for kind, meaning in MEANINGS.items())
    note = (
        "The same failures by the category of the shape and by what the wrong pose looks like, P1 "
        f"and views together. A pair counts under the first that fits. {kinds}. *Sure*: wrong with "
        f"a confidence above {SURE:g}."
    )
    return note + "\n\n" + table(["category", "pairs", "wrong %", *KINDS[1:], "sure"], lines)


def time_table(results: Results) -> str:
    rows = [r for r in ("P0/clean/180", *results["rows"]) if r in results["rows"]]
    rows = [r for r in rows if not r.startswith("P0/") or r == "P0/clean/180"]
    rows = list(dict.fromkeys(rows))
    methods = _measured(results, rows)
    lines = [
        [
            _short(row),
            *(
                _pair(of[m]["ms"], "{:.1f}") if m in (of := results["rows"][row]) else ""
                for m in methods
            ),
        ]
        for row in rows
    ]
    note = "Milliseconds a pair, median / 95th percentile:"
    return note + "\n\n" + table(["row", *(TITLES[m] for m in methods)], lines)


def peers_section(results: Results) -> str:
    lines = []
    for name in PEERS:
        if name in results["methods"]:
            identity = results["methods"][name]
            packages = ", ".join(f"{p} {v}" for p, v in identity["packages"].items())
            settings = ", ".join(f"{k} {v}" for k, v in identity["settings"].items())
            lines.append([TITLES[name], packages, settings])
    if not lines:
        return ""
    gaps = []
    for row in results["rows"]:
        gap = peer_gap(results, row)
        if gap:
            gaps.append([_short(row), TITLES[gap[0]], str(gap[1]), str(gap[2])])
    return "\n\n".join(
        [
            "Settings chosen on validation pairs from the grids in "
            "[tuned_peers.json](../train_py/vnreg_train/evaluate/tuned_peers.json) (`vnreg-train "
            "tune-peers`). small_gicp starts without any rotation: it is a refinement, here to "
            "show what starting from nothing costs. TEASER++ is not among the peers: its package "
            "(cmeel-teaser-plusplus) fetches further sources while it builds; KISS-Matcher solves "
            "its matches by the same graduated non-convexity.",
            table(["peer", "packages", "settings"], lines),
            "Failures (P0 plain, others up to symmetry) of the best peer in each row, and ours:",
            table(["row", "best peer", "its failures", "verified's"], gaps),
        ]
    )


def table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A Markdown table; columns of figures to the right."""
    rule = ["---" if k == 0 else "---:" for k in range(len(head))]
    rows = [head, rule, *lines]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in rows)


def _measured(results: Results, rows: Sequence[str]) -> list[str]:
    """Methods of any of the rows, in the order of TITLES."""
    found = {method for row in rows for method in results["rows"].get(row, {})}
    return [method for method in TITLES if method in found]


def _of_row(results: Results, row: str) -> list[tuple[str, dict[str, Any]]]:
    of = results["rows"].get(row, {})
    return [(method, of[method]) for method in TITLES if method in of]


def _short(row: str) -> str:
    return row.removeprefix("P1/") if row.startswith("P1/") else row


def interval(found: Mapping[str, Any]) -> str:
    """A share in %, with its 95 % interval."""
    low, high = found["interval_95"]
    return f"{100 * found['recall']:.1f} ({100 * low:.1f}–{100 * high:.1f})"


def _pair(found: Mapping[str, float | None], form: str) -> str:
    return " / ".join(_figure(found[name], form) for name in ("median", "p95"))


def _figure(value: float | None, form: str) -> str:
    return "–" if value is None else form.format(value)
