"""The small file that the C++ tests read: what is in it, and the command that writes it again.

python tests/python/model_format/tiny_file.py   # rewrites tests/data/model_format/tiny.vnr
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vnreg_train.model_file import MetadataValue, write_model

PATH = Path(__file__).parents[2] / "data" / "model_format" / "tiny.vnr"

METADATA: dict[str, MetadataValue] = {
    "arch": "golden",
    "model.name": "très petit 🐰",
    "model.crc": 0xE3069283,
    "limits.u64": 2**64 - 1,
    "limits.f64": -1.7976931348623157e308,
    "limits.tiny": 5e-324,
    "limits.third": 1 / 3,
    "flag.off": False,
    "flag.on": True,
    "provenance.empty": "",
}


def tensors() -> dict[str, NDArray[Any]]:
    """Values that the C++ test computes again: all of them are exact in their type."""
    float32 = np.finfo(np.float32)
    extremes = [float32.max, -float32.max, float32.smallest_subnormal, -0.0, 0.0]
    return {
        "input.source": np.arange(21, dtype=np.float32).reshape(7, 3) / 8 - 1,
        "input.target": np.arange(21, dtype=np.float64).reshape(7, 3) / 3,
        "stage.coarse.T": np.eye(4) + np.arange(16).reshape(4, 4) / 64,
        "stage.source.kept": np.array([5, 0, -(2**31), 2**31 - 1], dtype=np.int32),
        "stage.source.network0.block0": np.arange(40, dtype=np.float32).reshape(2, 5, 2, 2),
        "stage.source.significance": np.array(extremes, dtype=np.float32),
    }


if __name__ == "__main__":
    PATH.parent.mkdir(parents=True, exist_ok=True)
    write_model(PATH, METADATA, tensors())
