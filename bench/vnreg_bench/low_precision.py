"""What bfloat16 would give here: speed of products and encoders, recall with rounded weights.

The engine multiplies float32 only. Speed is that of libraries that have bfloat16: torch's products
(oneDNN), and the encoders under OpenVINO. Recall is the engine's, with the model's weights rounded
to bfloat16 and products in float32: the least that lower precision would change.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import torch

from vnreg_bench.contest import POINTS, prepare_network, run_contest
from vnreg_bench.inputs import SHIPPED
from vnreg_bench.machine import cpu_field, pin
from vnreg_bench.peers import SPLIT, right_up_to_symmetry
from vnreg_bench.settings import Settings
from vnreg_bench.timing import interleaved, milliseconds, summary
from vnreg_train.evaluate.measures import share
from vnreg_train.evaluate.methods import EngineMethod
from vnreg_train.evaluate.pairs import make_pairs
from vnreg_train.model_file import read_model, write_model

# Rows x depth of the weights; columns are the three components of 1,024 points.
SHAPES = ((256, 128), (128, 256), (128, 128), (48, 48), (32, 32))
COLUMNS = 3 * POINTS
REPEATS = 5  # products in a timed run


def low_precision(settings: Settings) -> dict[str, Any]:
    """One thread. `products`: GFLOP/s in float32, in bfloat16, and in bfloat16 from float32 points
    to float32 results. `encoders`: OpenVINO's milliseconds and error in both precisions. `recall`:
    of mode verified with weights as they are and rounded, by row."""
    pin(1)
    torch.set_num_threads(1)
    found: dict[str, Any] = {"native": "avx512_bf16" in cpu_field("flags").split()}
    found["products"] = {
        f"{rows} x {depth}": _product_rates(rows, depth, settings.rounds) for rows, depth in SHAPES
    }
    found["encoders"], found["recall"] = {}, {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for network in ("vnreg", "paper"):
            model, onnx = prepare_network(network, folder, POINTS)
            runtimes = ("engine", "OpenVINO", "OpenVINO bf16")
            # Not held to any error: how large it is, is the question.
            found["encoders"][network] = run_contest(
                model, onnx, POINTS, 1, settings.rounds, runtimes, within=float("inf")
            )
        rounded = folder / "rounded.vnr"
        round_weights(SHIPPED["vnreg"], rounded)
        for row in settings.peer_rows:
            found["recall"][row] = _recall(settings, row, rounded)
    return found


@torch.no_grad()
def _product_rates(rows: int, depth: int, rounds: int) -> dict[str, float]:
    x, w = torch.randn(COLUMNS, depth), torch.randn(rows, depth)
    y, x16, w16 = x @ w.T, x.bfloat16(), w.bfloat16()
    y16 = x16 @ w16.T

    def repeated(product: Any) -> Any:
        return lambda: milliseconds(lambda: [product() for _ in range(REPEATS)])

    times = interleaved(
        {
            "float32": repeated(lambda: torch.mm(x, w.T, out=y)),
            "bfloat16": repeated(lambda: torch.mm(x16, w16.T, out=y16)),
            "converted": repeated(lambda: (x.bfloat16() @ w16.T).float()),
        },
        rounds,
    )
    flops = 2.0 * rows * depth * COLUMNS * REPEATS
    return {name: 1e-6 * flops / summary(t)["median"] for name, t in times.items()}


def round_weights(model: Path, out: Path) -> None:
    """A model file whose weights are rounded to bfloat16 (to nearest), stored as float32."""
    metadata, tensors = read_model(model)
    rounded = {
        name: torch.from_numpy(np.array(value)).bfloat16().float().numpy()
        for name, value in tensors.items()
    }
    write_model(out, metadata, rounded)


def _recall(settings: Settings, row: str, rounded: Path) -> dict[str, dict[str, Any]]:
    pairs = make_pairs(SPLIT, row, settings.peer_shapes, data=settings.data)
    models = {"float32": SHIPPED["vnreg"], "bfloat16": rounded}
    found = {}
    for name, model in models.items():
        method = EngineMethod("verified", model)
        estimates = [method.estimate(pair) for pair in pairs]
        found[name] = share(right_up_to_symmetry(pairs, estimates))
    return found
