"""What the engine asks of a model file beyond the container: keys, ranges, tensors, shapes.

The tables of docs/design.md, "Tensors of architecture ...", in the order in which the engine reads
them: a file that breaks several rules is refused here with the words that it is refused with there.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from typing import TypeVar

from vnreg_train.model_file import MetadataValue, ModelFileError, Tensor

Metadata = Mapping[str, MetadataValue]
Shape = tuple[int, ...]
Wanted = Iterator[tuple[str, Shape]]
Value = TypeVar("Value", int, float, bool, str)

_TYPES = {int: "u64", float: "f64", bool: "bool", str: "string"}
_EVIDENCE = (
    "score",
    "margin",
    "covered",
    "contradicted",
    "beyond",
    "residual",
    "noise",
    "certainty",
)
_MOST = 512
_FINITE = sys.float_info.max
_MOMENT_SCALARS, _LOCAL_VECTORS, _CONTEXT_VECTORS = 18, 21, 8
_JUDGE_POINT_INPUTS, _JUDGE_POSE_INPUTS = 33, 3


def check_architecture(metadata: Metadata, tensors: Mapping[str, Tensor]) -> None:
    """Raises ModelFileError unless an engine can run the model that was read."""
    arch = _typed(metadata, "arch", str)
    if arch not in ("paper", "vnreg"):
        raise _refusal("arch", "paper or vnreg", arch if arch == "golden" else "another")
    _check_texts(metadata)
    channels = _index(metadata, "channels.global", 4, _MOST)
    paper = _paper_parameters(metadata) if arch == "paper" else {}
    _check_input(metadata, paper)
    _check_calibrations(metadata)
    wanted = _paper_tensors(channels, paper) if arch == "paper" else _vnreg_tensors(metadata)
    names = set()
    for name, shape in wanted:
        _check_tensor(tensors, name, shape)
        names.add(name)
    for name in sorted(tensors):
        if name not in names:
            expected = f"only the tensors of architecture {arch}"
            raise ModelFileError(f'tensor "{name}"', expected, "one more")


# ---- metadata ----


def _refusal(key: str, expected: str, got: object) -> ModelFileError:
    return ModelFileError(f'metadata "{key}"', expected, got)


def _typed(metadata: Metadata, key: str, kind: type[Value]) -> Value:
    if key not in metadata:
        raise _refusal(key, f"a {_TYPES[kind]}", "nothing")
    value = metadata[key]
    if type(value) is not kind:
        raise _refusal(key, f"a {_TYPES[kind]}", f"a {_TYPES[type(value)]}")
    return value


def _index(metadata: Metadata, key: str, low: int, high: int) -> int:
    value = _typed(metadata, key, int)
    if not low <= value <= high:
        raise _refusal(key, f"{low} to {high}", value)
    return value


def _number(metadata: Metadata, key: str, low: float, high: float) -> float:
    value = _typed(metadata, key, float)
    if not low <= value <= high:
        raise _refusal(key, f"{low:.17g} to {high:.17g}", f"{value:.17g}")
    return value


def _check_texts(metadata: Metadata) -> None:
    size = len(_typed(metadata, "name", str).encode())
    if not 1 <= size <= 64:
        raise _refusal("name", "1 to 64 bytes", size)
    for key in sorted(metadata):
        if key.startswith("provenance."):
            size = len(_typed(metadata, key, str).encode())
            if size > 4096:
                raise _refusal(key, "up to 4096 bytes", size)


def _paper_parameters(metadata: Metadata) -> dict[str, int]:
    parameters = {"local": _index(metadata, "channels.local", 4, _MOST)}
    if parameters["local"] % 4 != 0:
        raise _refusal("channels.local", "a multiple of 4", parameters["local"])
    for name in ("descriptor", "pair", "significance.0", "significance.1"):
        parameters[name] = _index(metadata, f"channels.{name}", 1, _MOST)
    parameters["neighbours"] = _index(metadata, "neighbours", 1, 64)
    parameters["shared"] = int(_typed(metadata, "relu.shared_direction", bool))
    for name in ("shared_encoder", "invariant_layer"):
        key = f"ablation.{name}"
        parameters[name] = int(_typed(metadata, key, bool)) if key in metadata else 1
    _index(metadata, "fine.iterations", 0, 16)
    parameters["divisor"] = _index(metadata, "fine.keep_divisor", 1, 64)
    return parameters


def _check_input(metadata: Metadata, paper: Mapping[str, int]) -> None:
    key = "input.rms_radius"
    if paper:
        radius = _number(metadata, key, 0.0, 1e3)
        if radius != 0.0 and radius < 1e-3:
            raise _refusal(key, "0 or 1e-3 to 1e3", f"{radius:f}")
    else:
        _number(metadata, key, 1e-3, 1e3)
    fewest = max(64, 24, paper.get("neighbours", 0), 3 * paper.get("divisor", 0))
    _index(metadata, "input.points", fewest, 16384)


def _check_calibrations(metadata: Metadata) -> None:
    plain = [f"calibration.{name}" for name in ("bias", "overlap", "residual")]
    verified = [f"calibration.verified.{name}" for name in (*_EVIDENCE, "bias")]
    for keys in (plain, verified):
        if any(key in metadata for key in keys):
            for key in keys:
                _number(metadata, key, -_FINITE, _FINITE)
    if "calibration.verified.covariance" in metadata:
        _number(metadata, "calibration.verified.covariance", 1e-3, 1e3)


# ---- tensors ----


def _check_tensor(tensors: Mapping[str, Tensor], name: str, shape: Shape) -> None:
    field = f'tensor "{name}"'
    if name not in tensors:
        raise ModelFileError(field, f"f32 of shape {_text(shape)}", "nothing")
    tensor = tensors[name]
    if tensor.shape != shape:
        raise ModelFileError(f"{field} shape", _text(shape), _text(tensor.shape))
    dtype = f"{tensor.dtype.kind}{8 * tensor.dtype.itemsize}"
    if dtype != "f32":
        raise ModelFileError(f"{field} dtype", "f32", dtype)


def _text(shape: Shape) -> str:
    return f"({', '.join(map(str, shape))})"


def _linear(name: str, out: int, inputs: int) -> Wanted:
    yield f"{name}.weight", (out, inputs)
    yield f"{name}.bias", (out,)


def _block(name: str, inputs: int, out: int, shared: int) -> Wanted:
    hidden = min(inputs, out)
    yield f"{name}.relu0", (1 if shared else inputs, inputs)
    yield f"{name}.fc0", (hidden, inputs)
    yield f"{name}.relu1", (1 if shared else hidden, hidden)
    yield f"{name}.fc1", (out, hidden)
    if inputs != out:
        yield f"{name}.shortcut", (out, inputs)


def _encoder(name: str, c: int, shared: int) -> Wanted:
    yield f"{name}.pre", (2 * c, 3)
    for block in ("network0.0", "network0.1", "network1.0", "network0.2", "network1.1"):
        yield from _block(f"{name}.{block}", 2 * c, c, shared)
    yield f"{name}.global.relu", (1 if shared else c, c)
    yield f"{name}.global.fc", (c, c)


def _invariant_layer(local: int, shared: int) -> Wanted:
    for index, inputs in enumerate((local, local // 2)):
        name, out = f"local.invariant.{index}", inputs // 2
        yield f"{name}.fc", (out, inputs)
        yield f"{name}.direction", (1 if shared else out, inputs)
        yield f"{name}.scale", (out,)
        yield f"{name}.shift", (out,)
    yield "local.invariant.2.fc", (3, local // 4)


def _paper_tensors(c: int, p: Mapping[str, int]) -> Wanted:
    local, d, pair, shared = p["local"], p["descriptor"], p["pair"], p["shared"]
    yield from _encoder("encoder", c, shared)
    if not p["shared_encoder"]:
        yield from _encoder("local.encoder", c, shared)
    yield from _block("local.network2.0", 2 * c, local, shared)
    yield from _block("local.network2.1", 2 * local, local, shared)
    if p["invariant_layer"]:
        yield from _invariant_layer(local, shared)
    yield from _linear("local.descriptor", d, 3 * local)
    yield from _linear("fine.significance.0", p["significance.0"], d)
    yield from _linear("fine.significance.1", p["significance.1"], p["significance.0"])
    yield from _linear("fine.significance.2", 1, p["significance.1"])
    yield from _linear("fine.weight.0", pair, pair)
    yield from _linear("fine.weight.1", 1, pair)
    yield from _linear("fine.pair.0", pair, 2 * d + 4)
    yield from _linear("fine.pair.1", pair, pair)
    yield from _linear("fine.similarity.0", pair, pair)
    yield from _linear("fine.similarity.1", 1, pair)


def _vnreg_tensors(metadata: Metadata) -> Wanted:
    """Reads the hyper-parameters of architecture `vnreg` first, which raises for wrong ones."""
    limits = {"product": 16}
    widths = {}
    for name in (
        *("vector", "scalar", "gate", "product"),
        *("local_descriptor", "context_descriptor", "frame"),
    ):
        widths[name] = _index(metadata, f"channels.{name}", 1, limits.get(name, _MOST))
    widths["global"] = _index(metadata, "channels.global", 4, _MOST)
    for stage in ("local", "context"):
        widths[f"{stage}_blocks"] = _index(metadata, f"blocks.{stage}", 1, 8)
    _index(metadata, "input.encoded", 24, 4096)
    for key in (*(f"moments.radius.{i}" for i in range(3)), *_neighbourhoods()):
        _number(metadata, key, 0.01, 10.0)
    yield "lengths", (2,)
    yield from _point_stage(widths)
    yield from _local_stage(widths)
    yield from _context_stage(widths)
    yield from _judge(metadata)


def _neighbourhoods() -> tuple[str, str]:
    return "neighbourhood.local", "neighbourhood.context"


def _point_stage(w: Mapping[str, int]) -> Wanted:
    c, h, p = w["vector"], w["scalar"], w["product"]
    yield from _linear("point.scalars", h, _MOMENT_SCALARS)
    yield "point.vectors", (c, _LOCAL_VECTORS)
    yield from _linear("point.gate", c, h)
    yield from _lean_block("point.block", c, False)
    yield "point.products", (p, c)
    yield from _linear("point.mlp", h, c * p + h)


def _local_stage(w: Mapping[str, int]) -> Wanted:
    c, h, p = w["vector"], w["scalar"], w["product"]
    yield from _collect("local", w)
    for index in range(w["local_blocks"]):
        yield from _lean_block(f"local.block.{index}", c, False)
    yield "local.products", (p, c)
    yield from _linear("local.mlp.0", h, c * p + 2 * h)
    yield from _linear("local.mlp.1", h, h)
    yield from _head("local", w)


def _context_stage(w: Mapping[str, int]) -> Wanted:
    c, h, p = w["vector"], w["scalar"], w["product"]
    yield "context.vectors", (c, _CONTEXT_VECTORS)
    yield from _collect("context", w)
    for index in range(w["context_blocks"]):
        yield from _lean_block(f"context.block.{index}", c, True)
    yield "context.products", (p, c)
    yield "context.products_pooled", (p, c)
    yield from _linear("context.mlp.0", h, 2 * c * p + 3 * h)
    yield from _linear("context.mlp.1", h, h)
    yield from _head("context", w)
    yield from _linear("context.logits", 3, h)
    yield "context.global", (w["global"], c)


def _collect(stage: str, w: Mapping[str, int]) -> Wanted:
    yield f"{stage}.collect", (w["vector"], w["gate"] + w["vector"])
    yield from _linear(f"{stage}.gate", w["gate"], w["scalar"])


def _lean_block(name: str, channels: int, pooled: bool) -> Wanted:
    for part in ("direction", "linear", "pool") if pooled else ("direction", "linear"):
        yield f"{name}.{part}", (channels, channels)


def _head(stage: str, w: Mapping[str, int]) -> Wanted:
    yield from _linear(f"{stage}.descriptor", w[f"{stage}_descriptor"], w["scalar"])
    yield f"{stage}.frames", (w["frame"], w["vector"])


def _judge(metadata: Metadata) -> Wanted:
    if "channels.judge" not in metadata:
        return
    hidden = _index(metadata, "channels.judge", 1, _MOST)
    yield from _linear("judge.point.0", hidden, _JUDGE_POINT_INPUTS)
    yield from _linear("judge.point.1", hidden, hidden)
    yield from _linear("judge.pose.0", hidden, hidden + _JUDGE_POSE_INPUTS)
    yield from _linear("judge.pose.1", 1, hidden)
