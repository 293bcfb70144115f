"""Tables of README.md and docs/batch.md, from the JSON of `make evaluate` and `make bench`.

python docs/page_tables.py            # writes them
python docs/page_tables.py --check    # says which are not what the JSON says, and fails

A table stands between the lines `<!-- table NAME: ... -->` and `<!-- end -->`.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from vnreg_train.evaluate.measures import limit_name
from vnreg_train.evaluate.report import PAPER_RECALL, table
from vnreg_train.evaluate.scores import LIMITS

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("README.md", "docs/batch.md")
MARKED = re.compile(r"(<!-- table (\w+): [^>]* -->\n)(.*?)(<!-- end -->)", re.S)
Json = dict[str, Any]

METHODS = {
    "verified": "`verified`",
    "paper": "`paper`",
    "open3d_ransac_icp": "Open3D RANSAC",
    "kiss_matcher_icp": "KISS-Matcher",
}
ROWS = {
    "P0/clean/180": "P0 clean",
    "P0/noisy/180": "P0 noisy",
    "P0/independent/180": "P0 independent",
    "P0/partial/180": "P0 partial",
    "P1/noise_0.01": "P1, noise 0.01",
    "P1/partial_75_noise_0.01": "P1, 75 % kept, noise 0.01",
    "P1/partial_50_noise_0.01": "P1, 50 % kept, noise 0.01",
    "views/scan_to_model": "single view onto a model",
    "views/two_scans": "two single views, up to 60° apart",
}
# The plan of docs/batch.md.
PLANNED_PAIRS = 1_000_000_000
PART_ROWS = (100, 1_000, 10_000, 100_000)
CORES = (100, 1_000, 10_000)


def results_table(results: Json, benchmark: Json) -> str:
    """Recall of the modes and of the best peers, and the time of a pair."""
    lines = []
    for row, title in ROWS.items():
        kind = "plain" if row.startswith("P0/") else "symmetric"
        cells = [_recall(results["rows"][row][method][kind]) for method in METHODS]
        setting = row.split("/")[1]
        paper = f"{PAPER_RECALL[setting][-1]:g}" if row.startswith("P0/") else ""
        lines.append([title, *cells, paper])
    times = [_range([results["rows"][row][m]["ms"]["median"] for row in ROWS]) for m in METHODS]
    lines.append(["ms a pair, one core", *times, ""])
    return table(["", *METHODS.values(), "the paper"], lines)


def _recall(of: Json) -> str:
    return f"{100 * of[limit_name(LIMITS[0])]['recall']:.1f}".replace("100.0", "100")


def _range(values: Sequence[float]) -> str:
    low, high = round(min(values)), round(max(values))
    return f"{low}" if low == high else f"{low}–{high}"


def speed_table(results: Json, benchmark: Json) -> str:
    """What `make bench` measures, in a few lines."""
    rivals = benchmark["contest"]["networks"]["vnreg"]["1"]
    ours = rivals["engine"]["median"]
    gains = ", ".join(
        f"{rivals[name]['median'] / ours:.1f}× {name}"
        for name in ("torch.compile", "ONNX Runtime", "OpenVINO")
    )
    tail = benchmark["latency"]["series"]["different pairs"]["tail"]
    points = benchmark["points"]["times"]
    sizes = {n: points[f"verified/{n}"]["median"] for n in (256, 1024, 4096)}
    lines = [
        [
            "a pair of 1,024 points, median and 99th percentile",
            f"{tail['p50']:.1f}, {tail['p99']:.1f} ms",
        ],
        [
            "a pair of " + ", ".join(f"{n:,}" for n in sizes) + " points",
            ", ".join(f"{ms:.0f}" for ms in sizes.values()) + " ms",
        ],
        ["the network alone, as fast as", gains],
        [
            "process that reads two files and aligns",
            f"{benchmark['footprint']['cold']['align']['median']:.0f} ms",
        ],
        ["library with the model", f"{1e-6 * benchmark['footprint']['library_bytes']:.1f} MB"],
        [
            "two worker processes of `vnreg.batch`",
            f"{benchmark['batch']['gain']['median']:.2f}× one",
        ],
    ]
    return table(["`verified`, one core", "measured"], lines)


def cost_table(results: Json, benchmark: Json) -> str:
    """Core-hours and hours of a billion pairs, by the rows of a part."""
    batch = benchmark["batch"]
    hours = pair_ms(batch) / 3.6e6
    lines = [
        ["core-hours", f"{1e6 * hours:.1f}", f"{PLANNED_PAIRS * hours:,.0f}"],
        ["price at P a core-hour", f"{1e6 * hours:.1f} P", f"{PLANNED_PAIRS * hours:,.0f} P"],
        *(
            [
                f"time on {cores:,} cores",
                _time(1e6 * hours / cores),
                _time(PLANNED_PAIRS * hours / cores),
            ]
            for cores in CORES
        ),
        [
            "bytes of results",
            _bytes(1e6 * batch["row_bytes"]),
            _bytes(PLANNED_PAIRS * batch["row_bytes"]),
        ],
        [
            "time of one client to make the parts",
            _time(1e6 / batch["client"]["pairs_per_s"] / 3600),
            _time(PLANNED_PAIRS / batch["client"]["pairs_per_s"] / 3600),
        ],
        ["parts a second that it has sent, one by one", f"{1000 / batch['part_ms']:.0f}", ""],
    ]
    return table(["", "a million pairs", "a billion pairs"], lines)


def parts_table(results: Json, benchmark: Json) -> str:
    """What the size of a part decides."""
    batch = benchmark["batch"]
    lines = [
        [
            f"{rows:,}",
            f"{PLANNED_PAIRS // rows:,}",
            _bytes(rows * batch["row_bytes"]),
            _time(rows * pair_ms(batch) / 3.6e6),
            f"{100 * batch['part_ms'] / (rows * pair_ms(batch)):.2g} %",
            f"{1000 * CORES[1] / (rows * pair_ms(batch)):,.1f}",
        ]
        for rows in PART_ROWS
    ]
    head = [
        "`part_rows`",
        "parts, tasks",
        "a part",
        "a task, and lost with a worker",
        "overhead",
        f"tasks a second on {CORES[1]:,} cores",
    ]
    return table(head, lines)


def pair_ms(batch: Json) -> float:
    """Of a worker, one of two that share a machine, reading and writing included."""
    return float(2 * batch["ms"]["2"]["median"] / batch["pairs"])


def _time(hours: float) -> str:
    for unit, size in (("h", 1.0), ("min", 60.0)):
        if hours * size >= 1:
            return f"{hours * size:.1f} {unit}"
    return f"{3600 * hours:.1f} s"


def _bytes(count: float) -> str:
    for unit in ("B", "kB", "MB"):
        if count < 999.5:
            return f"{count:.0f} {unit}"
        count /= 1000
    return f"{count:.0f} GB"


TABLES: dict[str, Callable[[Json, Json], str]] = {
    "results": results_table,
    "speed": speed_table,
    "cost": cost_table,
    "parts": parts_table,
}


def with_tables(page: str, results: Json, benchmark: Json) -> str:
    """The page's text with every table as the JSON says. KeyError for an unknown one."""
    return MARKED.sub(
        lambda found: f"{found[1]}\n{TABLES[found[2]](results, benchmark)}\n\n{found[4]}", page
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing, compare")
    check = parser.parse_args().check
    results, benchmark = (
        json.loads((ROOT / "docs" / path).read_text(encoding="utf-8"))
        for path in ("results/results.json", "benchmark/benchmark.json")
    )
    stale = []
    for name in PAGES:
        page = (ROOT / name).read_text(encoding="utf-8")
        wanted = with_tables(page, results, benchmark)
        if wanted != page:
            stale.append(name)
            if not check:
                (ROOT / name).write_text(wanted, encoding="utf-8")
    if check and stale:
        sys.exit(
            f"not what the JSON says: {', '.join(stale)}; write them: python docs/page_tables.py"
        )


if __name__ == "__main__":
    main()
