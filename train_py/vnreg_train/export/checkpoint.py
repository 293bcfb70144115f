"""From a checkpoint of either network to its model file."""

from __future__ import annotations

from pathlib import Path

import torch

from vnreg_train.export.descriptor_model import export_descriptor_model, load_descriptor_checkpoint
from vnreg_train.export.model import Metadata, export_model, load_checkpoint


def export_checkpoint(
    checkpoint: Path,
    path: Path,
    name: str | None = None,
    points: int = 1024,
    extra: Metadata | None = None,
) -> None:
    """Writes the averaged weights; `name` None: the configuration's. See `export_model`."""
    arch = torch.load(checkpoint, weights_only=True)["config"].get("arch", "paper")
    if arch == "vnreg":
        network, config = load_descriptor_checkpoint(checkpoint)
        export_descriptor_model(network, path, name or config["name"], points=points, extra=extra)
    else:
        paper, config = load_checkpoint(checkpoint)
        export_model(paper, path, name or config["name"], points=points, extra=extra)
