"""The recall table as Markdown, for docs/results.md and the model card."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from vnreg_train.evaluate.recall import RecallTable, Score

REGISTER_TITLES = {
    "coarse": "coarse alone",
    "fine": "coarse + fine",
    "verified": "mode verified",
}


def marks(mode: str) -> tuple[str, str]:
    """Lines around the section of one mode, in the file that holds it."""
    name = "recall" if mode == "paper" else f"recall, mode {mode}"
    return f"<!-- {name}: begin (written by vnreg-train evaluate) -->", f"<!-- {name}: end -->"


def _recall(score: Score) -> str:
    low, high = score.interval
    return f"{100 * score.recall:.1f} ({100 * low:.1f}–{100 * high:.1f})"


def _median_rotation(score: Score) -> str:
    return f"{score.median_rotation_deg:.2f}"


def _rows(
    table: RecallTable, part: str, render: Callable[[Score], str], settings: Sequence[str]
) -> list[str]:
    """Rows 'setting | register | one column per angle' of scores, same_crop or opposite_crop."""
    angles = sorted({cell.max_angle_deg for cell in table.cells})
    rows = []
    for setting in settings:
        for register in table.registers:
            cells = [getattr(table.cell(setting, angle), part) for angle in angles]
            if any(scores is None for scores in cells):
                continue
            figures = [render(scores[register]) for scores in cells]
            rows.append(f"| {setting} | {REGISTER_TITLES[register]} | {' | '.join(figures)} |")
    return rows


def _grid(table: RecallTable, rows: list[str]) -> str:
    angles = sorted({cell.max_angle_deg for cell in table.cells})
    head = " | ".join(f"θ = {angle:g}°" for angle in angles)
    rule = "|".join(["---"] * 2 + ["---:"] * len(angles))
    return "\n".join([f"| setting | register | {head} |", f"|{rule}|", *rows])


def markdown(table: RecallTable) -> str:
    """The whole section: recall with 95 % intervals, the halves of partial, median errors."""
    settings = list(dict.fromkeys(cell.setting for cell in table.cells))
    pairs = table.cells[0].scores[table.registers[0]].pairs
    parts = [
        f"Model `{table.model}`, mode `{table.mode}`, split `{table.split}`, protocol "
        f"`{table.protocol}`, "
        f"{pairs} pairs per cell, seed {table.seed}; measured through the engine. Recall in %: "
        "rotation error below 5° and translation error below 0.2, with the 95 % Wilson interval.",
        _grid(table, _rows(table, "scores", _recall, settings)),
    ]
    halves = [
        (title, _rows(table, part, _recall, settings))
        for title, part in (("same side", "same_crop"), ("opposite sides", "opposite_crop"))
    ]
    for title, rows in halves:
        if rows:
            parts += [
                f"Partial pairs whose clouds were cropped towards the {title}:",
                _grid(table, rows),
            ]
    parts += [
        "Median rotation error in degrees:",
        _grid(table, _rows(table, "scores", _median_rotation, settings)),
    ]
    return "\n\n".join(parts) + "\n"


def write_report(table: RecallTable, path: Path) -> None:
    """Puts the section between its mode's marks in a Markdown file; without them it comes last.

    Raises ValueError where only one mark is there, or they are in the wrong order.
    """
    begin_mark, end_mark = marks(table.mode)
    section = f"{begin_mark}\n{markdown(table)}{end_mark}\n"
    text = path.read_text(encoding="utf-8") if path.exists() else "# Results\n"
    begin, end = text.find(begin_mark), text.find(end_mark)
    if begin == -1 and end == -1:
        text = text.rstrip("\n") + "\n\n" + section
    elif 0 <= begin < end:
        text = text[:begin] + section + text[end + len(end_mark) :].removeprefix("\n")
    else:
        raise ValueError(f"{path}: expected {begin_mark!r} before {end_mark!r}")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
