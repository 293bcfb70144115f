"""The golden file of a model of architecture `vnreg`: a pair and every activation, to replay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import vnreg
from vnreg_train.export.descriptor_model import import_descriptor_model
from vnreg_train.export.descriptor_reference import DescriptorReference
from vnreg_train.model_file import MetadataValue, read_checksum, write_model


def export_descriptor_golden(
    model_path: Path, path: Path, source: NDArray[np.float64], target: NDArray[np.float64]
) -> None:
    """Clouds (N, 3), (M, 3), small enough for all points to be encoded, and torch's activations.

    The order of the encoded points is the engine's; what is in the rows is torch's, in float64.
    """
    network, metadata = import_descriptor_model(model_path)
    recorder = vnreg.Registrar(vnreg.Model.load(model_path), mode="coarse", record_stages=True)
    if not recorder.align(source, target).has_pose:
        raise ValueError("the clouds have no pose: nothing to record")
    recorded = recorder.stages()
    encoded = tuple(recorded[f"{side}.encoded"].astype(np.int32) for side in ("source", "target"))
    stages = DescriptorReference(network).describe(source, target, (encoded[0], encoded[1]))
    tensors: dict[str, NDArray[np.generic]] = {"input.source": source, "input.target": target}
    for side, order in zip(("source", "target"), encoded, strict=True):
        tensors[f"stage.{side}.encoded"] = order
        for name in ("frames.local", "frames.context"):
            stages[f"{side}.{name}"] = stages[f"{side}.{name}"].reshape(len(order), -1)
    exact = {"coarse.T"}  # poses stay in float64
    tensors |= {
        f"stage.{name}": value if name in exact else value.astype(np.float32)
        for name, value in stages.items()
    }
    golden: dict[str, MetadataValue] = {
        "arch": "golden",
        "model.name": str(metadata["name"]),
        "model.crc": read_checksum(model_path),
    }
    write_model(path, golden, tensors)
