"""docs/benchmark.md from a run's JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from vnreg_bench.bars import fastest_global_peer, verdicts
from vnreg_bench.peers import LOCAL
from vnreg_bench.side_by_side import gain
from vnreg_train.evaluate.report import table
from vnreg_train.evaluate.titles import TITLES

Report = Mapping[str, Any]
WAITING = {"default": "spin, then sleep", "passive": "sleep"}
# What a part's medians are over, where it is not rounds: the name of the setting.
RUNS = {
    "kernels": "kernel_repetitions",
    "latency": "latency_pairs",
    "peers": "peer_shapes",
    "batch": "batch_rounds",
}


def markdown(report: Report, plots: Mapping[str, str], folder: str = "benchmark") -> str:
    """The whole page. Plots (by part) lie, like benchmark.json, in `folder`; parts that the run
    left out are not mentioned."""
    parts = [
        "# Benchmark",
        "Written by `make bench` from one run; the figures behind it: "
        f"[benchmark.json]({folder}/benchmark.json).",
        how_measured(report),
        "## The bars",
        table(
            ("what", "bar", "aim", "measured", "bar met", "aim met"),
            [
                (v["what"], v["bar"], v["aim"], v["measured"], _word(v["met"]), _word(v["aim_met"]))
                for v in verdicts(report)
            ],
        ),
    ]
    for name, title, write in SECTIONS:
        if name in report:
            pictures = [
                f"![{title}]({folder}/{file})"
                for part, file in plots.items()
                if part.split("-")[0] == name
            ]
            parts += [f"## {title}", *write(report), *pictures]
    parts += ["## How each part was measured", parts_table(report)]
    return "\n\n".join(part for part in parts if part) + "\n"


def how_measured(report: Report) -> str:
    about = report["machine"]
    kernels = report.get("kernels", {})
    packages = ", ".join(f"{name} {of}" for name, of in about["packages"].items())
    caches = ", ".join(f"{name} {size}" for name, size in about["caches"].items())
    return "\n".join(
        [
            f"- **Machine**: {about['cpu']} (family {about['family']}), {about['cores']} cores, "
            f"{', '.join(about['extensions'])}; {caches}; {about['system']}.",
            f"- **Engine**: vnreg {about['vnreg']}, build {about['instruction_set']}, "
            f"{kernels.get('compiler', 'compiler not recorded')}.",
            f"- **Peers**: Python {about['python']}, {packages}. TEASER++ is not among them: its "
            "package (cmeel-teaser-plusplus) fetches further sources while it builds.",
            "- **Run**: times are medians of rounds that call everything in turns. Every process is"
            " pinned to as many processors as it has threads; one thread unless the table says "
            "otherwise. The last table says when, at which commit and beside what load each part "
            "was measured. Priority *real-time*: the benchmark came before ordinary programs on "
            "its processors, and took turns with others of its class; what they did to shared "
            "caches, memory and clock is in the figures.",
        ]
    )


def parts_table(report: Report) -> str:
    """How each part was measured. The load counts the benchmark itself, and what else ran."""
    lines = []
    for name, title, _ in SECTIONS:
        if name in report:
            about = report["measured"][name]
            settings = about["settings"]
            lines.append(
                (
                    title,
                    about["date"],
                    f"`{about['commit']}`",
                    f"{about['minutes']:.1f}",
                    f"{settings[RUNS.get(name, 'rounds')]:,}",
                    " – ".join(f"{load:.1f}" for load in about["load"]),
                    "real-time" if about["real_time"] else "ordinary",
                )
            )
    head = ("part", "date", "commit", "minutes", "runs", "load before – after", "priority")
    return table(head, lines)


def points_section(report: Report) -> list[str]:
    of = report["points"]
    sizes = sorted({int(key.split("/")[1]) for key in of["times"]})
    head = ("mode (model)", *(f"{n:,}" for n in sizes))
    lines = [
        (f"{label} ({model})", *(_ms(of["times"].get(f"{label}/{n}")) for n in sizes))
        for label, (_, model) in of["modes"].items()
    ]
    stages = [name for name in next(iter(of["stages"].values())) if name != "total"]
    stage_lines = [
        (key, *(_figure(times[name]) for name in stages))
        for key, times in of["stages"].items()
        if key.endswith(("/512", "/1024", "/4096"))
    ]
    return [
        "Milliseconds of one call from Python, by points of each cloud, none left out (mode "
        f"verified describes {of['described']} of them and judges by at most 2,048).",
        table(head, lines),
        "Stages, milliseconds:",
        table(("mode / points", *stages), stage_lines),
    ]


def channels_section(report: Report) -> list[str]:
    of = report["channels"]
    return [
        "Mode paper, random weights, L = C / 2, 1,024 points; `encode` is the network on both "
        "clouds.",
        table(
            ("C", *of["times"]),
            [
                ("whole, ms", *(_ms(t) for t in of["times"].values())),
                ("encode, ms", *(_figure(ms) for ms in of["encode"].values())),
            ],
        ),
    ]


def threads_section(report: Report) -> list[str]:
    times, processes = report["threads"]["times"], report["threads"]["processes"]
    labels = list(dict.fromkeys(key.split("/")[0] for key in times))
    counts = sorted({int(key.split("/")[1]) for key in times})
    lines = []
    for label in labels:
        ms = [times[f"{label}/{n}"]["median"] for n in counts]
        lines.append((label, *(_figure(m) for m in ms), f"{ms[0] / ms[-1]:.2f}×"))
    head = ("mode", *(f"{n} thread{'s' if n > 1 else ''}, ms" for n in counts), "gain")
    return [
        "One pair of 1,024 points; `paper128` is mode paper at the paper's own width.",
        table(head, lines),
        f"Right after that, {len(processes['together'])} processes of one thread (mode verified), "
        "which share nothing but the machine, got through "
        f"{gain(processes):.2f} times the calls of one at the same time.",
        *waiting_table(report["threads"]["waiting"]),
    ]


def waiting_table(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Quantiles by policy, number of busy programs and number of threads."""
    lines = [
        (
            WAITING[of["policy"]],
            str(of["busy"]),
            str(of["threads"]),
            *(_figure(of["tail"][q]) for q in ("p50", "p95", "p99")),
        )
        for of in found
    ]
    return [
        "Threads that wait for each other spin for a while before they sleep, unless the program "
        "was started with `OMP_WAIT_POLICY=passive` in its environment. That is what is fastest on "
        "processors that the program has for itself, and slow where others use them, too: the one "
        "that spins keeps the processor from the one that is waited for. Mode verified, ordinary "
        "priority, milliseconds:",
        table(("OpenMP's threads", "busy programs beside", "threads", "p50", "p95", "p99"), lines),
    ]


def latency_section(report: Report) -> list[str]:
    of = report["latency"]
    head = ("series", "calls", "p50", "p95", "p99", "p99.9", "p99 / p50")
    lines = []
    for name, found in of["series"].items():
        tail = found["tail"]
        quantiles = [_figure(tail[q]) for q in ("p50", "p95", "p99", "p99.9")]
        lines.append(
            (
                f"{name} ({found['pairs']})",
                f"{tail['runs']:,}",
                *quantiles,
                f"{tail['p99'] / tail['p50']:.2f}",
            )
        )
    medians = " and ".join(
        f"{_ms(t)} ms with {int(points):,} points" for points, t in of["medians"].items()
    )
    return [
        f"Mode verified, {of['points']:,} points, one thread, milliseconds; pairs of row "
        f"{of['row']} of the validation split, one behind the other. Median over these pairs: "
        f"{medians}.",
        table(head, lines),
    ]


def footprint_section(report: Report) -> list[str]:
    of = report["footprint"]
    cold = of["cold"]
    lines = [
        ("library, stripped, with the built-in model", f"{1e-6 * of['library_bytes']:.2f} MB"),
        ("process: start, read two files, load, align, print", f"{_ms(cold['align'])} ms"),
        ("of that, the first align", f"{_ms(of['first_align'])} ms"),
        ("process that only starts (`vnreg --version`)", f"{_ms(cold['version'])} ms"),
    ]
    return [
        "1,024 points, mode verified, one thread; files in the page cache.",
        table(("what", "measured"), lines),
    ]


def contest_section(report: Report) -> list[str]:
    of = report["contest"]
    lines = []
    for network, by_threads in of["networks"].items():
        for threads, found in by_threads.items():
            ours = found["engine"]["median"]
            for runtime, t in found.items():
                lines.append(
                    (
                        network,
                        threads,
                        runtime,
                        _ms(t),
                        f"{_figure(t['q1'])}–{_figure(t['q3'])}",
                        f"{t['median'] / ours:.1f}×",
                        "" if runtime == "engine" else f"{t['error']:.1e}",
                    )
                )
    return [
        f"The encoder alone, both clouds of {of['points']:,} points in one batch: what the engine "
        "calls its stage encode, from the same inputs to the same outputs. `small` and `paper` (C ="
        " 128, random weights) are the paper's network; its neighbours and its registers are in no "
        "one's time. Every runtime has a process of its own; torch.compile with frozen weights, "
        "OpenVINO in float32. *error*: the largest normalised difference of an output from the "
        f"engine's, checked to be below {of['equal_within']:g} before anything is timed.",
        table(
            ("network", "threads", "runtime", "ms, median", "quartiles", "of the engine", "error"),
            lines,
        ),
    ]


def peers_section(report: Report) -> list[str]:
    of = report["peers"]
    parts = [
        f"{of['shapes']} pairs of the {of['split']} split a row, 1,024 points a cloud, one thread, "
        "processor time. Recall up to symmetry within 5° and 0.2, in %, with the 95 % Wilson "
        "interval. The peers are tuned on that split and followed by ICP "
        f"([results.md](results.md)); {LOCAL} is local: it starts from no rotation."
    ]
    for row, methods in of["rows"].items():
        ours = methods["verified"]["ms"]
        lines = []
        for name, found in methods.items():
            lines.append(
                (
                    TITLES[name],
                    _share(found),
                    f"{found['ms']:.1f}",
                    f"{found['ms_p95']:.1f}",
                    f"{found['ms'] / ours:.1f}×",
                )
            )
        head = (f"method, row {row}", "recall", "ms, median", "ms, p95", "of verified")
        parts.append(table(head, lines))
    name, ratio, as_good = fastest_global_peer(report)
    word = "no lower" if as_good else "lower"
    parts.append(
        f"The fastest global peer is {name}: {ratio:.1f} times the time of mode verified, whose "
        f"recall is {word}."
    )
    return parts


def kernels_section(report: Report) -> list[str]:
    of = report["kernels"]
    roof = ", ".join(
        f"{name} {value:.0f} {'GFLOP/s' if name == 'product' else 'GB/s'}"
        for name, value in of["roof"].items()
    )
    lines = [
        (
            f"`{row['name']}`",
            _time(row["ns"]),
            f"{100 * row['spread']:.0f} %",
            _figure(row["GFLOP/s"]) if row["GFLOP/s"] > 0 else "",
            _figure(row["GB/s"]),
            row["bound"],
            f"{100 * row['share']:.0f} %"
            if row["share"] > 0.0095
            else f"{100 * row['share']:.1f} %",
        )
        for row in of["rows"]
    ]
    return [
        f"Roofline, measured in turns with the benchmarks: {roof}. *product* is a large float32 "
        "product by Eigen, one thread, the build's instructions; the others are a triad a = b + s·c"
        " over a working set of that level. *share* is the least time that this roofline allows "
        "for the counted work over the time taken, *bound* what sets it: the product's rate, or "
        "the bandwidth of the smallest level that holds the operands. Above 100 %: faster than "
        "Eigen's product.",
        "Counted: products as two operations per multiply-add; element-wise kernels all they do; "
        "searches the box bounds and distances that an exact search on this index cannot avoid; "
        "bytes of each operand once. Sorting, selection and 3 × 3 decompositions have no roofline "
        "worth the name; their share says so. The encoders are counted by their products in the "
        "exact algebra of [design.md](design.md) (7.4 GFLOP for the paper's at C = 128, 1,024 "
        "points, both clouds; 12.2 as usually written), `vnreg` with the sums of its "
        "neighbourhoods, nothing element-wise. Arguments stand behind the name: "
        "[bench/](../bench).",
        table(("benchmark", "time", "spread", "GFLOP/s", "GB/s", "bound", "share"), lines),
    ]


def low_precision_section(report: Report) -> list[str]:
    of = report["low_precision"]
    product_lines = [
        (
            shape,
            *(_figure(rates[name]) for name in ("float32", "bfloat16", "converted")),
            f"{rates['bfloat16'] / rates['float32']:.2f}×",
            f"{rates['converted'] / rates['float32']:.2f}×",
        )
        for shape, rates in of["products"].items()
    ]
    encoder_lines = []
    for network, found in of["encoders"].items():
        full, half, ours = (found[k] for k in ("OpenVINO", "OpenVINO bf16", "engine"))
        encoder_lines.append(
            (
                network,
                _ms(ours),
                _ms(full),
                _ms(half),
                f"{full['median'] / half['median']:.2f}×",
                f"{half['error']:.1e}",
            )
        )
    return [
        "The engine multiplies float32 only. What bfloat16 products would give on this machine "
        f"({'with' if of['native'] else 'without'} instructions for them), by libraries that have "
        "them: torch's products (oneDNN), one thread, GFLOP/s, weights rows x depth times the "
        "three components of 1,024 points; *converted* starts from float32 points and ends with "
        "float32, as a layer between float32 VN-ReLUs has to.",
        table(
            ("product", "float32", "bfloat16", "converted", "bfloat16", "converted"),
            product_lines,
        ),
        "Whole encoders under OpenVINO, one thread, and the largest normalised error of an output "
        "in bfloat16 (1: as large as the output itself; the moments are differences of sums, "
        "which 8 bits do not hold):",
        table(
            ("network", "engine, ms", "OpenVINO f32, ms", "bf16, ms", "gain", "bf16 error"),
            encoder_lines,
        ),
        "Recall of mode verified, in %, with the model's weights rounded to bfloat16 and products "
        "in float32:",
        table(
            ("row", "float32", "rounded"),
            [
                (row, *(_share(found[name]) for name in ("float32", "bfloat16")))
                for row, found in of["recall"].items()
            ],
        ),
        low_precision_verdict(report),
    ]


def low_precision_verdict(report: Report) -> str:
    """What the figures say to the condition: at least 1.3 times as fast, recall unchanged."""
    of = report["low_precision"]

    def gains(kind: str) -> str:
        found = [rates[kind] / rates["float32"] for rates in of["products"].values()]
        return f"{min(found):.2f} to {max(found):.2f}"

    runs = of["encoders"]["vnreg"]
    gain = runs["OpenVINO"]["median"] / runs["OpenVINO bf16"]["median"]
    text = (
        "The condition was 1.3 times the speed at unchanged recall. bfloat16 operands multiply "
        f"{gains('bfloat16')} times as fast, but between float32 VN-ReLUs they have to be made and "
        f"taken back: then the gain is {gains('converted')} (with conversions as passes of their "
        "own; fused into a kernel they would cost less). A runtime that computes everything in "
        f"bfloat16 encodes the default network {gain:.2f} times as fast, and its outputs are of no "
        "use: the moments would have to stay in float32."
    )
    if "points" in report:
        stages = report["points"]["stages"]["verified/1024"]
        share = stages["encode"] / stages["total"]
        whole = 1 / (1 - share + share / gain)
        text += (
            f" The encoder takes {100 * share:.0f} % of a pair in mode verified, so even that gain "
            f"would be {whole:.2f} times on a pair: "
            f"{'worth trying' if whole >= 1.3 else 'float32 stays'}."
        )
    return text


def batch_section(report: Report) -> list[str]:
    of = report["batch"]
    lines = []
    for workers, times in of["ms"].items():
        rate = 1e3 * of["pairs"] / times["median"]
        lines.append((workers, _ms(times), _figure(rate), _figure(1e3 * int(workers) / rate)))
    gain = of["gain"]
    return [
        f"`vnreg.batch` of {of['pairs']} pairs of files, {of['points']:,} points each, parts of "
        f"{of['part_rows']} rows, on clusters that are up; every worker has a processor, scheduler "
        "and client run beside them. Rounds call both in turns.",
        table(("workers", "ms", "pairs/s", "worker's ms a pair"), lines),
        f"Gain of the second worker: {gain['median']:.2f}× (quartiles {gain['q1']:.2f} and "
        f"{gain['q3']:.2f}). A part costs {_figure(of['part_ms'])} ms beside its pairs, a row "
        f"{of['row_bytes']:.0f} bytes; the client makes parts of a parquet table at "
        f"{of['client']['pairs_per_s']:,.0f} pairs/s.",
    ]


SECTIONS: tuple[tuple[str, str, Callable[[Report], list[str]]], ...] = (
    ("points", "Time against points", points_section),
    ("channels", "Time against channels", channels_section),
    ("threads", "Time against threads", threads_section),
    ("latency", "Latency", latency_section),
    ("footprint", "Cold start and size", footprint_section),
    ("peers", "Other registration programs", peers_section),
    ("contest", "Other runtimes, same weights", contest_section),
    ("kernels", "Kernels against the roofline", kernels_section),
    ("low_precision", "Lower precision", low_precision_section),
    ("batch", "Many pairs on worker processes", batch_section),
)


def _share(found: Mapping[str, Any]) -> str:
    low, high = found["interval_95"]
    return f"{100 * found['recall']:.1f} ({100 * low:.1f}–{100 * high:.1f})"


def _word(met: bool) -> str:
    return "met" if met else "**missed**"


def _ms(of: Mapping[str, float] | None) -> str:
    return "" if of is None else _figure(of["median"])


def _figure(value: float) -> str:
    """Three digits."""
    digits = 0 if value >= 100 else 1 if value >= 10 else 2
    return f"{value:,.{digits}f}"


def _time(ns: float) -> str:
    for unit, size in (("ns", 1.0), ("µs", 1e3), ("ms", 1e6)):
        if ns < 1000 * size:
            return f"{_figure(ns / size)} {unit}"
    return f"{_figure(ns / 1e9)} s"
