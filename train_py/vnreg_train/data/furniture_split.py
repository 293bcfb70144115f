"""The fixed split of the furniture models into train, validation and test.

The list furniture_split.csv beside this file is committed and never changes; this module reads
it, and can draw it again from the archives to prove where it comes from:

    python -m vnreg_train.data.furniture_split FOLDER_OF_ARCHIVES [--write] [--list FILE]
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from vnreg_train.data.catalog import Model, read_catalogs, read_objects, sha256
from vnreg_train.data.duplicates import duplicate_groups, fingerprint
from vnreg_train.data.mesh import MeshError, welded
from vnreg_train.data.obj import parse_obj

SPLIT_FILE = Path(__file__).with_name("furniture_split.csv")
SPLITS = ("train", "validation", "test", "dropped")
SHARES = {"train": 0.7, "validation": 0.1, "test": 0.2}
SEED = 2023


class SplitError(ValueError):
    """A split list that is malformed, or that the archives contradict."""


@dataclass(frozen=True)
class SplitRow:
    """One model of the list. `split` is dropped for a degenerate mesh; `name` then says why."""

    model: str
    split: str
    group: int
    category: str
    name: str
    licence: str
    creator: str
    archive: str
    sha256: str


def read_split(path: Path = SPLIT_FILE) -> list[SplitRow]:
    """The rows of a split list. Raises SplitError for missing columns or bad values."""
    with path.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        columns = [field.name for field in fields(SplitRow)]
        if reader.fieldnames != columns:
            raise SplitError(f"{path}: columns must be {columns}, got {reader.fieldnames}")
        rows = [_row(path, line) for line in reader]
    sides: dict[int, str] = {}
    for row in rows:
        if row.split != "dropped" and sides.setdefault(row.group, row.split) != row.split:
            raise SplitError(f"{path}: group {row.group} is in {row.split} and another split")
    if len({row.model for row in rows}) != len(rows):
        raise SplitError(f"{path}: a model occurs twice")
    return rows


def _row(path: Path, line: dict[str, str]) -> SplitRow:
    if line["split"] not in SPLITS:
        raise SplitError(f"{path}: {line['model']}: unknown split {line['split']!r}")
    try:
        values: dict[str, str | int] = {**line, "group": int(line["group"])}
        return SplitRow(**values)  # type: ignore[arg-type]  # only the group is a number
    except (TypeError, ValueError) as error:
        raise SplitError(f"{path}: {line.get('model')}: {error}") from error


def write_split(rows: Sequence[SplitRow], path: Path) -> None:
    """Write a split list as CSV with Unix line ends."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(SplitRow)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)


def draw_split(groups: Sequence[int], categories: Sequence[str], seed: int = SEED) -> list[str]:
    """Split of every model (M,): whole groups, 70/10/20 overall and near it in each category.

    Largest groups first, then in random order, each goes where its categories lack most.
    """
    kinds = {name: k for k, name in enumerate(sorted(set(categories)))}
    members: dict[int, list[int]] = {}
    for index, group in enumerate(groups):
        members.setdefault(group, []).append(index)
    counts = {
        group: np.bincount([kinds[categories[i]] for i in inside], minlength=len(kinds))
        for group, inside in members.items()
    }
    total = sum(counts.values(), np.zeros(len(kinds)))
    lacking = {split: share * total for split, share in SHARES.items()}
    shuffled = np.random.default_rng(seed).permutation(sorted(members))
    chosen = [""] * len(groups)
    for group in sorted(map(int, shuffled), key=lambda g: -len(members[g])):
        add = counts[group]
        split = max(SHARES, key=lambda s: _gain(lacking[s], add, SHARES[s] * total))
        lacking[split] = lacking[split] - add
        for index in members[group]:
            chosen[index] = split
    return chosen


def _gain(lacking: np.ndarray, add: np.ndarray, target: np.ndarray) -> float:
    """How much a squared, relative lack per category and overall shrinks by adding counts."""
    each = (lacking**2 - (lacking - add) ** 2) / target
    whole = (lacking.sum() ** 2 - (lacking - add).sum() ** 2) / target.sum()
    return float(each.sum() + whole)


def make_split(folder: Path) -> list[SplitRow]:
    """The split list drawn anew from the five archives in `folder` (minutes)."""
    models = read_catalogs(folder)
    prints, kept, rows = [], [], []
    for model, data in read_objects(folder, models):
        try:
            prints.append(fingerprint(model.path, welded(parse_obj(data))))
            kept.append((model, sha256(data)))
        except MeshError as error:
            rows.append(_split_row(model, "dropped", -1, sha256(data), f"{model.name}: {error}"))
    groups = [int(group) for group in duplicate_groups(prints)]
    splits = draw_split(groups, [model.category for model, _ in kept])
    for (model, digest), split, group in zip(kept, splits, groups, strict=True):
        rows.append(_split_row(model, split, group, digest, model.name))
    return sorted(rows, key=lambda row: row.model)


def _split_row(model: Model, split: str, group: int, digest: str, name: str) -> SplitRow:
    return SplitRow(
        model=model.path,
        split=split,
        group=group,
        category=model.category,
        name=name,
        licence=model.licence,
        creator=model.creator,
        archive=model.archive,
        sha256=digest,
    )


def verify_objects(rows: Iterable[SplitRow], folder: Path) -> None:
    """Raise SplitError unless every listed OBJ is in the archives with its listed SHA-256."""
    listed = {row.model: row for row in rows}
    models = [model for model in read_catalogs(folder) if model.path in listed]
    missing = listed.keys() - {model.path for model in models}
    if missing:
        raise SplitError(f"{folder}: {len(missing)} listed models lack, first {min(missing)}")
    for model, data in read_objects(folder, models):
        check_digest(listed[model.path], data)


def check_digest(row: SplitRow, data: bytes) -> None:
    """Raise SplitError unless the OBJ's bytes have the listed SHA-256."""
    found = sha256(data)
    if found != row.sha256:
        raise SplitError(
            f"{row.model}: SHA-256 {found[:16]}... differs from the split list's "
            f"{row.sha256[:16]}...: another version of the furniture package?"
        )


def main(words: Sequence[str] | None = None) -> None:
    """Draw the split again; compare it with the committed list, or write it."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path, help="folder of the five .sh3f archives")
    parser.add_argument("--write", action="store_true", help="replace the list")
    parser.add_argument("--list", type=Path, default=SPLIT_FILE, help="default: the committed one")
    arguments = parser.parse_args(words)
    rows = make_split(arguments.folder)
    if arguments.write:
        write_split(rows, arguments.list)
    elif rows != read_split(arguments.list):
        raise SystemExit(f"the split drawn from these archives differs from {arguments.list}")
    print(*(f"{s}: {sum(row.split == s for row in rows)}" for s in SPLITS))


if __name__ == "__main__":
    main()
