"""What all Python tests share."""

from __future__ import annotations

import torch


def pytest_configure() -> None:
    """One torch thread: the tests' tensors are small, and other cores may be busy."""
    torch.set_num_threads(1)
