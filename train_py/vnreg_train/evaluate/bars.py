"""What the project asks of mode verified on the test split, and whether a run has it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from vnreg_train.evaluate.measures import NEES_DIMENSIONS, limit_name
from vnreg_train.evaluate.peers import PEERS
from vnreg_train.evaluate.scores import LIMITS

METHOD = "verified"
LIMIT = limit_name(LIMITS[0])
MOST_MS = 15.0
NEES_SLACK = 0.2


@dataclass(frozen=True)
class RecallBar:
    """Recall in % of a row: the paper's own result, the bar, the aim."""

    row: str
    paper: float | None
    bar: float
    aim: float


RECALL_BARS = (
    RecallBar("P0/clean/180", 100.0, 100.0, 100.0),
    RecallBar("P0/noisy/180", 98.9, 99.2, 100.0),
    RecallBar("P0/independent/180", 90.2, 98.5, 100.0),
    RecallBar("P0/partial/180", 78.3, 97.0, 99.5),
    RecallBar("P1/noise_0.01", None, 97.0, 99.5),
    RecallBar("P1/partial_75_noise_0.01", None, 88.0, 97.0),
    RecallBar("P1/partial_50_noise_0.01", None, 45.0, 80.0),
)


@dataclass(frozen=True)
class Verdict:
    """One line of the table of bars; figures as text."""

    what: str
    paper: str
    measured: str
    bar: str
    aim: str
    met: bool
    aim_met: bool


def recall_kind(row: str) -> str:
    """P0 is judged as the paper judges; P1 up to the shape's symmetry."""
    return "plain" if row.startswith("P0/") else "symmetric"


def recall_of(results: Mapping[str, Any], row: str, method: str) -> dict[str, Any]:
    """The share that decides about a row. Raises KeyError where it was not measured."""
    found: dict[str, Any] = results["rows"][row][method][recall_kind(row)][LIMIT]
    return found


def verdicts(results: Mapping[str, Any]) -> Iterator[Verdict]:
    """Every bar of which the run has the figures."""
    rows = {row for row, of in results["rows"].items() if METHOD in of}
    for bar in RECALL_BARS:
        if bar.row in rows:
            yield _recall_verdict(results, bar)
    yield from _confidence_verdicts(results)
    yield from _covariance_verdicts(results)
    peers = [row for row in results["rows"] if row in rows and _best_peer(results, row)]
    if peers:
        yield _peer_verdict(results, peers)
    if rows:
        yield _time_verdict(results, sorted(rows))


def _recall_verdict(results: Mapping[str, Any], bar: RecallBar) -> Verdict:
    share = recall_of(results, bar.row, METHOD)
    low, high = share["interval_95"]
    recall = 100 * share["recall"]
    kind = "" if recall_kind(bar.row) == "plain" else ", up to symmetry"
    return Verdict(
        f"{bar.row}: recall %{kind}",
        "–" if bar.paper is None else f"{bar.paper:g}",
        f"{recall:.1f} ({100 * low:.1f}–{100 * high:.1f})",
        f"{bar.bar:g}",
        f"{bar.aim:g}",
        recall >= bar.bar,
        recall >= bar.aim,
    )


def _confidence_verdicts(results: Mapping[str, Any]) -> Iterator[Verdict]:
    found = results["pooled"].get(METHOD, {}).get("P1", {}).get("confidence")
    if found:
        a, e = found["auroc"] or 0.0, found["ece"]
        yield Verdict("P1, all rows: AUROC", "–", f"{a:.3f}", "0.95", "0.99", a >= 0.95, a >= 0.99)
        yield Verdict("P1, all rows: ECE", "–", f"{e:.3f}", "0.05", "0.02", e <= 0.05, e <= 0.02)


def _covariance_verdicts(results: Mapping[str, Any]) -> Iterator[Verdict]:
    found = results["pooled"].get(METHOD, {}).get("P1", {}).get("nees")
    if found:
        met = abs(found["mean"] / NEES_DIMENSIONS - 1) <= NEES_SLACK
        yield Verdict(
            "P1, all rows: covariance, mean e^T C^-1 e of right poses",
            "–",
            f"{found['mean']:.2f}",
            f"{NEES_DIMENSIONS} ± {NEES_SLACK:.0%}",
            f"{NEES_DIMENSIONS}",
            met,
            met,
        )


def _best_peer(results: Mapping[str, Any], row: str) -> str | None:
    measured = [name for name in PEERS if name in results["rows"][row]]
    return max(measured, key=lambda n: recall_of(results, row, n)["hits"], default=None)


def peer_gap(results: Mapping[str, Any], row: str) -> tuple[str, int, int] | None:
    """The best peer of a row, its failures and ours; None where one was not measured."""
    best = _best_peer(results, row)
    if best is None or METHOD not in results["rows"][row]:
        return None
    theirs, ours = (recall_of(results, row, name) for name in (best, METHOD))
    return best, theirs["pairs"] - theirs["hits"], ours["pairs"] - ours["hits"]


def _peer_verdict(results: Mapping[str, Any], rows: list[str]) -> Verdict:
    """Above every peer in a row: fewer failures, or none where the peer has none."""
    gaps = [gap for row in rows if (gap := peer_gap(results, row))]
    above = sum(ours < theirs or ours == theirs == 0 for _, theirs, ours in gaps)
    half = sum(2 * ours <= theirs for _, theirs, ours in gaps)
    return Verdict(
        "above every peer; half the best one's failures",
        "–",
        f"{above} of {len(gaps)} rows; {half} of {len(gaps)}",
        "every row",
        "every row",
        above == len(gaps),
        half == len(gaps),
    )


def _time_verdict(results: Mapping[str, Any], rows: list[str]) -> Verdict:
    """The slowest row's median."""
    worst = max(rows, key=lambda row: results["rows"][row][METHOD]["ms"]["median"])
    ms = results["rows"][worst][METHOD]["ms"]["median"]
    met = ms <= MOST_MS
    return Verdict(
        f"median ms a pair, one core, slowest row ({worst})",
        "–",
        f"{ms:.1f}",
        f"{MOST_MS:g}",
        "–",
        met,
        met,
    )
