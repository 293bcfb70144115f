"""The project's bars for speed, and what a run says to each. All are ratios or milliseconds of one
run on one machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from vnreg_bench.peers import LOCAL
from vnreg_train.evaluate.titles import TITLES

Report = Mapping[str, Any]
PAPER_PAIRS_PER_S = 36.4  # Lin et al., ICRA 2023, on a Titan RTX


@dataclass(frozen=True)
class Bar:
    """value: from a report; KeyError where the run left that part out. form: of the figures."""

    what: str
    value: Callable[[Report], float]
    bar: float
    aim: float
    form: str
    at_least: bool

    def verdict(self, report: Report) -> dict[str, Any] | None:
        """None where the run does not tell."""
        try:
            value = self.value(report)
        except KeyError:
            return None
        sign = 1 if self.at_least else -1
        return {
            "what": self.what,
            "bar": self.text(self.bar),
            "aim": self.text(self.aim),
            "measured": self.form.format(value),
            "met": sign * value >= sign * self.bar,
            "aim_met": sign * value >= sign * self.aim,
        }

    def text(self, limit: float) -> str:
        return f"{'≥' if self.at_least else '≤'} {self.form.format(limit)}"


def kernel_row(report: Report, name: str) -> Mapping[str, Any]:
    """Raises KeyError for a benchmark that was not run."""
    for row in report["kernels"]["rows"]:
        if row["name"] == name:
            found: Mapping[str, Any] = row
            return found
    raise KeyError(name)


def _share(name: str) -> Callable[[Report], float]:
    return lambda report: 100 * kernel_row(report, name)["share"]


def _kernel_ms(name: str) -> Callable[[Report], float]:
    return lambda report: 1e-6 * kernel_row(report, name)["ns"]


def _against(runtime: str) -> Callable[[Report], float]:
    def ratio(report: Report) -> float:
        of = report["contest"]["networks"]["vnreg"]["1"]
        return float(of[runtime]["median"] / of["engine"]["median"])

    return ratio


def _verified_ms(points: int) -> Callable[[Report], float]:
    return lambda report: float(report["latency"]["medians"][str(points)]["median"])


def _pairs_per_s(report: Report) -> float:
    return float(1e3 / report["threads"]["times"]["paper128/2"]["median"])


def _two_threads(report: Report) -> float:
    times = report["threads"]["times"]
    return float(times["verified/1"]["median"] / times["verified/2"]["median"])


def fastest_global_peer(report: Report) -> tuple[str, float, bool]:
    """Over all rows: the peer that is fastest there, its time over ours, and whether our recall is
    no smaller; of the row where that ratio is smallest."""
    found = []
    for of in report["peers"]["rows"].values():
        ours = of["verified"]
        others = {k: v for k, v in of.items() if k not in ("verified", "paper", LOCAL)}
        name = min(others, key=lambda k: others[k]["ms"])
        peer = others[name]
        found.append((peer["ms"] / ours["ms"], name, ours["recall"] >= peer["recall"]))
    ratio, name, as_good = min(found)
    return TITLES[name], ratio, as_good and all(good for _, _, good in found)


def _peer_ratio(report: Report) -> float:
    _, ratio, as_good = fastest_global_peer(report)
    return ratio if as_good else 0.0


def _tail(series: str) -> Callable[[Report], float]:
    def ratio(report: Report) -> float:
        of = report["latency"]["series"][series]["tail"]
        return float(of["p99"] / of["p50"])

    return ratio


def _growth(mode: str) -> Callable[[Report], float]:
    def ratio(report: Report) -> float:
        times = report["points"]["times"]
        return float(times[f"{mode}/4096"]["median"] / times[f"{mode}/1024"]["median"])

    return ratio


def _library_mb(report: Report) -> float:
    return float(1e-6 * report["footprint"]["library_bytes"])


def _cold_ms(report: Report) -> float:
    return float(report["footprint"]["cold"]["align"]["median"])


BARS = (
    Bar(
        "encoder, default network, 1 thread: share of the roofline",
        _share("encode_vnreg/1024/1"),
        60,
        80,
        "{:.0f} %",
        True,
    ),
    Bar(
        "encoder, paper network (C = 128, N = 1,024), 1 thread: share of the roofline",
        _share("encode_paper/128/1024/1"),
        65,
        85,
        "{:.0f} %",
        True,
    ),
    Bar(
        "paper network, both clouds, 2 threads, whole paper mode",
        _pairs_per_s,
        25,
        PAPER_PAIRS_PER_S,
        "{:.1f} pairs/s",
        True,
    ),
    Bar(
        "default network, network only, against torch.compile, 1 thread",
        _against("torch.compile"),
        3,
        6,
        "{:.2f}×",
        True,
    ),
    Bar("the same against ONNX Runtime", _against("ONNX Runtime"), 2, 4, "{:.2f}×", True),
    Bar("the same against OpenVINO", _against("OpenVINO"), 1.5, 3, "{:.2f}×", True),
    Bar(
        "mode verified, 1,024 points, 1 thread, median",
        _verified_ms(1024),
        10,
        4,
        "{:.1f} ms",
        False,
    ),
    Bar(
        "mode verified, 512 points, 1 thread, median",
        _verified_ms(512),
        5,
        2,
        "{:.1f} ms",
        False,
    ),
    Bar("two threads on one pair, mode verified", _two_threads, 1.7, 1.7, "{:.2f}×", True),
    Bar(
        "against the fastest global peer at equal or better recall",
        _peer_ratio,
        2,
        10,
        "{:.1f}×",
        True,
    ),
    Bar(
        "p99 / p50 latency, one pair again and again",
        _tail("one pair"),
        1.5,
        1.1,
        "{:.2f}",
        False,
    ),
    Bar(
        "p99 / p50 latency, different pairs of the same size",
        _tail("different pairs"),
        1.5,
        1.1,
        "{:.2f}",
        False,
    ),
    Bar(
        "kNN (k = 20), 1,024 points, 1 thread",
        _kernel_ms("mean_neighbours/1024"),
        1,
        0.3,
        "{:.2f} ms",
        False,
    ),
    Bar(
        "moments, 1,024 points, 1 thread",
        _kernel_ms("moments_of_half/1024"),
        1,
        0.3,
        "{:.2f} ms",
        False,
    ),
    Bar(
        "growth from N = 1,024 to 4,096, mode verified",
        _growth("verified"),
        6,
        4.2,
        "{:.1f}×",
        False,
    ),
    Bar(
        "growth from N = 1,024 to 4,096, mode paper (quadratic: it compares a sixth of the points)",
        _growth("paper"),
        6,
        4.2,
        "{:.1f}×",
        False,
    ),
    Bar(
        "library size, stripped, with the built-in model",
        _library_mb,
        3,
        1.5,
        "{:.2f} MB",
        False,
    ),
    Bar(
        "`vnreg.batch`, two worker processes against one",
        lambda report: float(report["batch"]["gain"]["median"]),
        1.8,
        1.95,
        "{:.2f}×",
        True,
    ),
    Bar("load + first align, cold process", _cold_ms, 30, 10, "{:.1f} ms", False),
)


def verdicts(report: Report) -> list[dict[str, Any]]:
    """Of all bars that the run tells of."""
    found = (bar.verdict(report) for bar in BARS)
    return [verdict for verdict in found if verdict is not None]
