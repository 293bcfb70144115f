"""The model file of the paper's modes."""

from pathlib import Path

SHIPPED = Path(__file__).resolve().parents[3] / "models" / "small.vnr"
