"""`vnreg-train inspect`: what a model file, a golden file or a checkpoint holds, as text."""

from __future__ import annotations

import pickle
import re
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vnreg_train.export.architecture import check_architecture
from vnreg_train.model_file import (
    MAJOR_VERSION,
    MINOR_VERSION,
    MetadataValue,
    ModelFileError,
    read_checksum,
    read_model,
)
from vnreg_train.training.checkpoint import read_checkpoint

Metadata = Mapping[str, MetadataValue]
Tensors = Mapping[str, NDArray[Any]]
WIDTH = 100
STATISTICS = ("running_mean", "running_var", "num_batches_tracked")  # of batch norms


class InspectError(ValueError):
    """A file of no kind that is known here."""


def inspection(path: Path) -> str:
    """Of a `.vnr` file or a checkpoint. Raises InspectError, OSError."""
    if path.suffix == ".pt":
        return checkpoint_text(path)
    try:
        metadata, tensors = read_model(path)
    except ModelFileError as error:
        raise InspectError(f"{path}: neither a model file nor a .pt checkpoint: {error}") from error
    if metadata.get("arch") == "golden":
        return golden_text(path, metadata, tensors)
    return model_text(path, metadata, tensors)


def model_text(path: Path, metadata: Metadata, tensors: Tensors) -> str:
    """Everything about a model file, and what lies beside it."""
    about = {
        "file": f"{path}, {path.stat().st_size:,} bytes, format {MAJOR_VERSION}.{MINOR_VERSION}",
        "name": metadata.get("name", "none"),
        "architecture": f"{metadata.get('arch')}, {_completeness(metadata, tensors)}",
        "weights": _weights(tensors),
        "checksum": f"{read_checksum(path):08x}",
    }
    groups = ("calibration.", "provenance.")
    rest = {k: v for k, v in metadata.items() if not k.startswith(groups) and k not in about}
    parts = [
        _section("model", about),
        _section("hyper-parameters", {k: v for k, v in rest.items() if k != "arch"}),
        _judge(metadata, tensors),
        _calibration(metadata),
        _section("provenance", _group(metadata, "provenance.")) or "provenance: none",
        _card(path.with_suffix(".md")),
        _golden_beside(path),
        tensor_table(tensors),
    ]
    return "\n\n".join(parts)


def golden_text(path: Path, metadata: Metadata, tensors: Tensors) -> str:
    """Which model a golden file is of, its clouds and its stages."""
    about = {
        "file": f"{path}, {path.stat().st_size:,} bytes",
        "model": f"{metadata.get('model.name')}, checksum {int(metadata['model.crc']):08x}",
        "clouds": _clouds(tensors),
    }
    return "\n\n".join([_section("golden file", about), tensor_table(tensors)])


def checkpoint_text(path: Path) -> str:
    """Where a run stands, its configuration, and its averaged weights."""
    try:
        # torch meets bytes that are no archive with whatever its unpickler trips over.
        if not zipfile.is_zipfile(path):
            raise InspectError(f"{path}: not a checkpoint: expected a zip archive")
        state = read_checkpoint(path)
    except (pickle.UnpicklingError, RuntimeError) as error:
        raise InspectError(f"{path}: not a checkpoint: {error}") from error
    missing = {"stage", "step", "network", "ema", "optimizer", "schedule", "config"} - set(state)
    if missing:
        raise InspectError(f"{path}: not a checkpoint of vnreg-train: no {sorted(missing)[0]}")
    network, average = ({k: v.numpy() for k, v in state[key].items()} for key in ("network", "ema"))
    config = _flat(state["config"])
    about = {
        "file": f"{path}, {path.stat().st_size:,} bytes",
        "architecture": config.get("arch", "paper"),
        "stage": state["stage"],
        "step": f"{state['step']:,} of {state['schedule']['total_steps']:,}",
        "learning rate": f"{state['optimizer']['param_groups'][0]['lr']:.3g}",
        "skipped steps": state.get("skipped", "not recorded"),
        "averages taken": f"{int(state['ema_updates']):,}",
        "weights": _weights(average),
        "last to averaged": f"{_distance(network, average):.4g} (norm of the difference)",
    }
    parts = [_section("checkpoint", about), _section("configuration", config)]
    return "\n\n".join([*parts, "averaged " + tensor_table(average)])


def tensor_table(tensors: Tensors) -> str:
    """A line for each tensor: shape, numbers, Euclidean norm, r.m.s., largest absolute number."""
    width = max(len(name) for name in tensors)
    head = f"  {'name':<{width}}  {'shape':>14}  {'numbers':>8}  {'norm':>9}  {'rms':>9}  largest"
    lines = []
    for name, tensor in tensors.items():
        values = np.asarray(tensor, np.float64)
        shape = " x ".join(map(str, values.shape)) or "scalar"
        norm, largest = float(np.linalg.norm(values)), float(np.abs(values).max(initial=0))
        rms = norm / max(values.size, 1) ** 0.5
        lines.append(
            f"  {name:<{width}}  {shape:>14}  {values.size:>8}  {norm:>9.4g}  {rms:>9.3g}"
            f"  {largest:.3g}"
        )
    return "\n".join([f"tensors: {_weights(tensors)}", head, *lines])


def _weights(tensors: Tensors) -> str:
    numbers = sum(tensor.size for tensor in tensors.values())
    size = sum(tensor.nbytes for tensor in tensors.values())
    return f"{numbers:,} numbers in {len(tensors)} tensors, {size:,} bytes"


def _completeness(metadata: Metadata, tensors: Tensors) -> str:
    try:
        check_architecture(dict(metadata), dict(tensors))
    except ModelFileError as error:
        return f"which the engine refuses: {error}"
    return "complete: every tensor of it, in the right shape, and no other"


def _judge(metadata: Metadata, tensors: Tensors) -> str:
    hidden = metadata.get("channels.judge")
    if hidden is None:
        return "judge: none; the last poses are told apart by their fit alone"
    own = {name: tensor for name, tensor in tensors.items() if name.startswith("judge.")}
    return f"judge: {hidden} hidden channels, {_weights(own)}"


def _calibration(metadata: Metadata) -> str:
    """The confidence's weights, of each mode, and the covariance's factor."""
    verified = _group(metadata, "calibration.verified.")
    if "covariance" in verified:
        verified["factor of the covariance"] = verified.pop("covariance")
    paper = {k: v for k, v in _group(metadata, "calibration.").items() if "." not in k}
    parts = [
        _section(f"calibration of mode {mode}: sigmoid of the bias and the weighted evidence", of)
        for mode, of in (("verified", verified), ("paper", paper))
        if of
    ]
    return "\n\n".join(parts) or "calibration: none; the confidence is NaN"


def _group(metadata: Metadata, prefix: str) -> dict[str, MetadataValue]:
    return {k.removeprefix(prefix): v for k, v in metadata.items() if k.startswith(prefix)}


def _card(path: Path) -> str:
    """The rows of the card's first table."""
    if not path.exists():
        return f"card: none at {path}"
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", path.read_text(encoding="utf-8"))
    table = re.search(r"^\|[\s\S]*?(?=^[^|]|\Z)", text, re.M)
    cells = [
        [cell.strip() for cell in line.strip("|").split("|", 1)]
        for line in (table[0].splitlines() if table else [])
    ]
    rows = {row[0]: row[1] for row in cells if len(row) == 2 and row[0].strip("- ")}
    return _section(f"card {path}", rows) or f"card {path}: it has no table"


def _golden_beside(path: Path) -> str:
    """Whether the golden file beside a model was made of these weights."""
    golden = path.with_suffix(".golden.vnr")
    if not golden.exists():
        return f"golden file: none at {golden}"
    metadata, tensors = read_model(golden)
    same = metadata.get("model.crc") == read_checksum(path)
    what = "of this model" if same else "OF ANOTHER MODEL: write it anew (vnreg-train golden)"
    stages = sum(name.startswith("stage.") for name in tensors)
    size = golden.stat().st_size
    about = {"pair": _clouds(tensors), "stages": stages, "bytes": f"{size:,}"}
    return _section(f"golden file {golden}, {what}", about)


def _clouds(tensors: Tensors) -> str:
    return " and ".join(f"{len(tensors[f'input.{side}'])} points" for side in ("source", "target"))


def _distance(network: Tensors, average: Tensors) -> float:
    """Of what is learnt: the statistics of batch norms would drown it."""
    learnt = {k: v for k, v in average.items() if k.rsplit(".", 1)[-1] not in STATISTICS}
    squares = (float(np.square(network[k] - v, dtype=np.float64).sum()) for k, v in learnt.items())
    return float(sum(squares) ** 0.5)


def _flat(config: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested tables as `table.key`."""
    flat: dict[str, Any] = {}
    for key, value in config.items():
        if isinstance(value, dict) and value:
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


def _section(title: str, values: Mapping[str, Any]) -> str:
    """A title and a line for each value; "" without values."""
    if not values:
        return ""
    width = max(len(key) for key in values)
    lines = (
        fill(
            f"  {key:<{width}}  {_shown(value)}",
            WIDTH,
            subsequent_indent=" " * (width + 4),
            break_long_words=False,
        )
        for key, value in values.items()
    )
    return "\n".join([title, *lines])


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(_shown(one) for one in value)
    return str(value)
