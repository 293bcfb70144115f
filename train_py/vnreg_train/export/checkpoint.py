"""From a checkpoint of either network to its model file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vnreg_train.export.descriptor_model import export_descriptor_model, load_descriptor_checkpoint
from vnreg_train.export.model import (
    Metadata,
    config_from_metadata,
    export_golden,
    export_model,
    load_checkpoint,
)
from vnreg_train.model_file import read_model
from vnreg_train.training.checkpoint import read_checkpoint


def checkpoint_arch(checkpoint: Path) -> str:
    """`paper` or `vnreg`."""
    return str(read_checkpoint(checkpoint)["config"].get("arch", "paper"))


def export_checkpoint(
    checkpoint: Path,
    path: Path,
    name: str | None = None,
    points: int = 1024,
    extra: Metadata | None = None,
) -> None:
    """Writes the averaged weights; `name` None: the configuration's. See `export_model`."""
    if checkpoint_arch(checkpoint) == "vnreg":
        network, config = load_descriptor_checkpoint(checkpoint)
        export_descriptor_model(network, path, name or config["name"], points=points, extra=extra)
    else:
        paper, config = load_checkpoint(checkpoint)
        export_model(paper, path, name or config["name"], points=points, extra=extra)


def golden_of_checkpoint(
    checkpoint: Path,
    model: Path,
    path: Path,
    source: NDArray[np.float64],
    target: NDArray[np.float64],
) -> None:
    """Writes what torch makes of a pair of clouds (N, 3), (M, 3), for the model file `model`."""
    if checkpoint_arch(checkpoint) == "vnreg":
        from vnreg_train.export.descriptor_golden import export_descriptor_golden  # needs vnreg

        export_descriptor_golden(model, path, source, target)
    else:
        network, _ = load_checkpoint(checkpoint)
        # A file may match more points more often than its network was trained for.
        config = config_from_metadata(read_model(model)[0])
        network.fine.iterations = config.fine_iterations
        network.fine.keep_divisor = config.keep_divisor
        export_golden(network, model, path, source, target)
