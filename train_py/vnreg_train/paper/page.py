"""docs/paper.md from the figures beside it: the paper's tables, reproduced as far as they go."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from vnreg_train.data.protocol import ANGLES_DEG
from vnreg_train.evaluate.bars import LIMIT
from vnreg_train.evaluate.report import PAPER_RECALL, interval, table
from vnreg_train.evaluate.rows import PAPER_SETTINGS
from vnreg_train.evaluate.titles import TITLES
from vnreg_train.paper.note_values import note_values
from vnreg_train.paper.published import BARS, BASELINES, SPEED_BAR
from vnreg_train.paper.variants import BASE, VARIANTS

Figures = Mapping[str, Any]
PARTS = ("recall", "longer", "iterations", "ablation", "speed", "training_speed", "curve")
OURS = ("coarse", "paper")
MODE_TITLES = {"coarse": "**ours**, coarse", "paper": "**ours**, coarse + fine"}
PEERS = ("verified", "open3d_ransac_icp", "open3d_fgr_icp", "kiss_matcher_icp", "small_gicp")
TABLE_V = ("neither", "invariant", "vectors", "both", BASE)
ADDITIONS = (
    "fixed_samples",
    "tested_candidates",
    "uncentred_occupancy",
    "last_weights",
    "plain_centroids",
)


def read_figures(folder: Path, results: Path, benchmark: Path) -> dict[str, Any]:
    """The parts of a folder that are there, as `results` what the peers reached, and as
    `kernel_rate` the GFLOP/s of our fastest product.
    """
    found: dict[str, Any] = {}
    for part in PARTS:
        path = folder / f"{part}.json"
        if path.exists():
            found[part] = json.loads(path.read_text(encoding="utf-8"))
    found["results"] = json.loads(results.read_text(encoding="utf-8"))
    kernels = json.loads(benchmark.read_text(encoding="utf-8"))["kernels"]["rows"]
    products = [of for of in kernels if of["name"].startswith("packed_product")]
    found["kernel_rate"] = max(float(of["GFLOP/s"]) for of in products)
    return found


def markdown(figures: Figures, notes: str) -> str:
    """The whole page; `notes` are the paragraphs at its end, figures in braces."""
    parts = [
        "# The paper's tables",
        "What the paper claims, trained here and run by the engine. `make paper` writes this page "
        "from its figures, [recall.json](paper/recall.json) and others beside it; each part can be "
        "made alone (see the Makefile).",
    ]
    sections = (
        ("recall", "Recall", recall_section),
        ("curve", "How the network learned", curve_section),
        ("ablation", "Ablation", ablation_section),
        ("speed", "What the shared encoder saves", speed_section),
        ("training_speed", "Training speed", training_section),
    )
    for part, title, section in sections:
        if part in figures:
            parts += [f"## {title}", section(figures)]
    return "\n\n".join([*parts, notes.strip().format_map(note_values(figures))]) + "\n"


# ---- recall ----


def recall_section(figures: Figures) -> str:
    about = figures["recall"]["about"]
    model = figures["recall"]["methods"]["paper"]["model"]
    return "\n\n".join(
        [
            f"Protocol P0, plain recall in % (5 degrees, 0.2) with the 95 % Wilson interval: "
            f"{about['shapes']} pairs a cell, one a shape of the {about['split']} split, seed "
            f"{about['seed']}, through the engine (model `{model}`, one thread, {about['cpu']}). "
            "The paper and its baselines are on ModelNet40, trained on a GPU; our data is the "
            "furniture, with many symmetric shapes. Peers: [results](results.md).",
            bars_table(figures),
            "The last column is the same network with a longer search of its fine register; the "
            f"paper's takes N/6 points and 3 iterations (median {longer_ms(figures):.0f} ms a "
            "pair; chosen on validation shapes).",
            iterations_text(figures["iterations"]),
            *(setting_table(figures, setting) for setting in PAPER_SETTINGS),
            "*Partial*, apart by whether both clouds were cropped towards the same side (they "
            "then share nearly all points) or towards opposite ones (two thirds):",
            halves_table(figures),
        ]
    )


def bars_table(figures: Figures) -> str:
    lines = []
    for setting, bar in BARS.items():
        row = figures["recall"]["rows"][f"P0/{setting}/180"]
        coarse, fine = (row[mode]["plain"][LIMIT] for mode in OURS)
        verdict = "met" if 100 * fine["recall"] >= bar else "missed"
        paper = f"{PAPER_RECALL[setting][-1]:g}"
        longer = figures["longer"]["rows"][f"P0/{setting}/180"]["paper"]["plain"][LIMIT]
        cells = [interval(coarse), interval(fine), f"{bar:g}", verdict, paper, interval(longer)]
        lines.append([setting, *cells])
    settings = figures["longer"]["settings"]
    more = f"N/{settings['fine.keep_divisor']} points, {settings['fine.iterations']} iterations"
    return table(["180°", "coarse", "coarse + fine", "bar", "", "the paper", more], lines)


def iterations_text(found: Figures) -> str:
    settings = list(found["coarse"])
    lines = [_iterations_line(of, settings, "") for of in found["lines"]]
    lines += [_iterations_line(of, settings, ", before refining") for of in found["before"]]
    return (
        f"More points and iterations of the fine register with the same weights, on "
        f"{found['pairs']} pairs of the {found['split']} split; and the same network before its "
        "fine register was refined:\n\n"
        + table(["points, iterations", *settings, "ms a pair"], lines)
    )


def _iterations_line(of: Figures, settings: Sequence[str], after: str) -> list[str]:
    title = f"N/{of['keep_divisor']}, {of['iterations']}{after}"
    return [title, *(interval(of["recall"][name]) for name in settings), f"{of['ms']:.0f}"]


def longer_ms(figures: Figures) -> float:
    """Of its rows, the slowest's."""
    rows = figures["longer"]["rows"].values()
    return max(float(row["paper"]["ms"]["median"]) for row in rows)


def setting_table(figures: Figures, setting: str) -> str:
    rows = [f"P0/{setting}/{angle}" for angle in ANGLES_DEG]
    lines = [_measured(figures["recall"], rows, mode, MODE_TITLES[mode]) for mode in OURS]
    lines.append(["the paper", *(f"{x:g}" for x in PAPER_RECALL[setting])])
    lines += [
        [f"{name}, from the paper", *(f"{x:g}" for x in of[setting])]
        for name, of in BASELINES.items()
    ]
    lines += [
        _measured(figures["results"], rows, peer, TITLES[peer])
        for peer in PEERS
        if peer in figures["results"]["rows"].get(rows[0], {})
    ]
    return table([setting, *(f"{angle}°" for angle in ANGLES_DEG)], lines)


def _measured(results: Figures, rows: Sequence[str], method: str, title: str) -> list[str]:
    return [title, *(interval(results["rows"][row][method]["plain"][LIMIT]) for row in rows)]


def halves_table(figures: Figures) -> str:
    lines = []
    for half in ("same", "opposite"):
        for mode in OURS:
            shares = [
                figures["recall"]["rows"][f"P0/partial/{angle}"][mode]["halves"][half]
                for angle in ANGLES_DEG
            ]
            lines.append([f"{half}, {mode}", *map(interval, shares)])
    return table(["cropped sides, mode", *(f"{angle}°" for angle in ANGLES_DEG)], lines)


def curve_section(figures: Figures) -> str:
    """Two rows a figure: the steps, and the means since the step before."""
    lines = []
    for stage, curves in figures["curve"]["curves"].items():
        for figure, points in curves.items():
            lines.append([f"{stage}, until step", *(f"{step:,}" for step, _ in points)])
            lines.append([figure, *(_curve_value(figure, value) for _, value in points)])
    width = max(len(line) for line in lines)
    return (
        "The training behind the table above, 16 pairs a step: loss of the coarse poses, then of "
        "the matching, then of the matching as it is refined on what the fine register meets at "
        "test time (configs/refined.toml), and the share of training pairs within the limits, in "
        "%.\n\n" + table([""] * width, [line + [""] * (width - len(line)) for line in lines])
    )


def _curve_value(figure: str, value: float) -> str:
    return f"{100 * value if figure == 'recall' else value:.3g}"


# ---- ablation ----


def ablation_section(figures: Figures) -> str:
    found = figures["ablation"]
    trained = next(iter(found["variants"].values()))["pairs_trained"]
    network = found["config"]["network"]
    parts = [
        f"*Independent*, 180 degrees. Each line trained alike, from the start and on "
        f"{trained['coarse']:,} pairs in the coarse stage and {trained['fine']:,} in the fine one "
        f"({found['config']['data']['points']} points, C = {network['global_channels']}, "
        f"configs/ablation.toml): minutes, where the paper took days. It can show the "
        f"order, not the height. {found['pairs']} pairs of the {found['split']} split; by the "
        "engine, except what it does not run (no vector neurons, unweighted centroids), which the "
        "torch reference registers.",
        ablation_table(found, TABLE_V),
        order_sentence(found),
        lines_speed(figures["speed"]),
        "Ours, one at a time, against *both, shared encoder*:",
        ablation_table(found, (BASE, *ADDITIONS)),
        "Learning curves, means over tenths of the training (registration loss of the coarse "
        "stage, matching loss of the fine one; the share of training pairs within the limits):",
        curves_table(found),
    ]
    return "\n\n".join(part for part in parts if part)


def ablation_table(found: Figures, names: Sequence[str]) -> str:
    lines = []
    for name in names:
        if name in found["variants"]:
            of, variant = found["variants"][name], VARIANTS[name]
            paper = "" if variant.paper_recall is None else f"{variant.paper_recall:g}"
            by = "engine" if of["engine"] else "torch"
            coarse, fine = of["recall"]["coarse"], of["recall"]["fine"]
            medians = [f"{found['median_deg']:.1f}°" for found in (coarse, fine)]
            cells = [interval(coarse), medians[0], interval(fine), medians[1]]
            lines.append([variant.title, *cells, paper, by])
    head = ["", "coarse", "median error", "coarse + fine", "median error", "the paper", "run by"]
    return table(head, lines)


def order_sentence(found: Figures) -> str:
    """Whether the variants come in the paper's order, the last two taken as equal (89.5, 90.2)."""
    missing = [VARIANTS[name].title for name in TABLE_V if name not in found["variants"]]
    if missing:
        return f"Order as in the paper: **not shown**; not trained: {', '.join(missing)}."
    reached = [found["variants"][name]["recall"]["fine"]["hits"] for name in TABLE_V]
    neither, invariant, vectors, both, shared = reached
    same = max(neither, invariant) < vectors < min(both, shared)
    verdict = "met" if same else "missed"
    return f"Order as in the paper (neither and invariant < vectors < both): **{verdict}**."


def lines_speed(found: Figures) -> str:
    """Pairs/s of the paper's lines, ours beside the paper's; of our additions where they differ."""
    lines = []
    for name in (*TABLE_V, "plain_centroids"):
        of, paper = found["lines"][name], VARIANTS[name].paper_pairs_per_second
        engine = "not run" if of["engine"] is None else f"{of['engine']:.1f}"
        rate = "" if paper is None else f"{paper:g}"
        lines.append([VARIANTS[name].title, engine, f"{of['torch']:.1f}", rate])
    return (
        f"Pairs/s of each line at the paper's width (C = 128, {found['points']:,} points, random "
        f"weights, one thread of an {found['cpu']}, in turns, medians of processor times); the "
        "torch reference, which is plain and not fast, for the lines that the engine does not run. "
        "Lines that differ in their training alone are as fast as *both, shared encoder*.\n\n"
        + table(["", "engine", "torch reference", "the paper, Titan RTX"], lines)
    )


def curves_table(found: Figures) -> str:
    lines = []
    for name, of in found["variants"].items():
        for stage, curves in of["curves"].items():
            if VARIANTS[name].trained_as is None:
                for figure, points in curves.items():
                    values = [_curve_value(figure, value) for _, value in points]
                    lines.append([f"{VARIANTS[name].title}: {stage}, {figure}", *values])
    width = max(len(line) for line in lines)
    lines = [line + [""] * (width - len(line)) for line in lines]
    return table(["", *(f"{k + 1}" for k in range(width - 1))], lines)


# ---- speed ----


def speed_section(figures: Figures) -> str:
    found = figures["speed"]
    lines = []
    for name, of in found["networks"].items():
        rate = of["pairs_per_second"]
        verdict = "met" if of["ratio"] >= SPEED_BAR else "missed"
        ratio = f"{of['ratio']:.2f}"
        cells = [f"{rate['shared']:.1f}", f"{rate['two']:.1f}", ratio, f"{SPEED_BAR:g}", verdict]
        lines.append([f"width of `{name}`", *cells])
    lines.append(["the paper, Titan RTX", "36.4", "17.8", "2.04", "", ""])
    return (
        f"Mode `paper`, {found['points']:,} points, one thread of an {found['cpu']} "
        f"({found['instruction_set']}), random weights, both networks in turns, medians of "
        "processor times. Pairs/s:\n\n"
        + table(["", "shared encoder", "two encoders", "ratio", "bar", ""], lines)
    )


def training_section(figures: Figures) -> str:
    found = figures["training_speed"]
    lines = [
        [
            title,
            f"{of['points']:,}",
            str(of["batch"]),
            f"{of['pairs_per_second']:.1f}",
            f"{of['gflop_per_pair']:.2f}",
            f"{of['gflop_per_second']:.1f}",
        ]
        for title, of in found["recipes"].items()
    ]
    paper = found["paper"]
    return "\n\n".join(
        [
            f"Coarse stage of configs/small.toml (C = 48) unless said, forward, backward and "
            f"update, median step by processor time on {found['threads']} thread of an "
            f"{found['cpu']}, torch {found['torch']}. GFLOP: the matrix products alone.",
            table(
                ["", "points", "batch", "pairs/s", "GFLOP a pair", "GFLOP/s"],
                lines,
            ),
            f"configs/paper.toml on ModelNet40 ({paper['shapes']:,} shapes, batch "
            f"{paper['batch']}), extrapolated from the measured steps: {paper['epoch_hours']:.1f} "
            f"hours an epoch of the coarse stage on that thread, {paper['all_epochs_days']:.0f} "
            f"days for its 1,000 epochs; about {paper['memory_gib']:.1f} GiB of memory.",
        ]
    )
