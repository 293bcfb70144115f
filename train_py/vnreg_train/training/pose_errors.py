"""How far poses are from the truth, in torch."""

from __future__ import annotations

import torch
from torch import Tensor

RIGHT_DEG, RIGHT_SHIFT = 5.0, 0.2  # the paper's limits


def angle_deg(rotation: Tensor) -> Tensor:
    """Of rotations (…, 3, 3), by the chord 2 sqrt(2) sin(angle / 2), which keeps small angles."""
    identity = torch.eye(3, dtype=rotation.dtype, device=rotation.device)
    chord = torch.linalg.matrix_norm(rotation - identity)
    return 2 * torch.rad2deg(torch.asin((chord / 8**0.5).clamp(max=1.0)))


@torch.no_grad()
def pose_errors(rotation: Tensor, translation: Tensor) -> Tensor:
    """Degrees and lengths (B, 2) of what separates poses from the true ones, (B, 3, 3), (B, 3)."""
    return torch.stack([angle_deg(rotation), translation.norm(dim=1)], dim=1)


def recall(errors: Tensor) -> Tensor:
    """Share of the errors (B, 2) within both limits."""
    return ((errors[:, 0] < RIGHT_DEG) & (errors[:, 1] < RIGHT_SHIFT)).float().mean()


def error_figures(errors: Tensor) -> dict[str, float]:
    """Recall and median errors of errors (B, 2)."""
    median = errors.median(dim=0).values
    return {
        "recall": float(recall(errors)),
        "rotation_deg": float(median[0]),
        "translation": float(median[1]),
    }
