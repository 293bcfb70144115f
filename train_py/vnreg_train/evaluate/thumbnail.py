"""A small still picture of two clouds in one frame, as SVG."""

from __future__ import annotations

import numpy as np

from vnreg_train.data.mesh import Float64

SIZE = 150  # pixels, of a panel
MARGIN = 8
DOTS = 320  # of each cloud
TILT_DEG = (25.0, 35.0)  # about the picture's axes, so that flat things do not hide in themselves


def thumbnail(target: Float64, sources: list[tuple[str, Float64]]) -> str:
    """Panels side by side: the target (M, 3) under each of the named sources (N, 3).

    The stylesheet around it colours the classes `target` and `source`.
    """
    view = _view(target)
    shown = [_thinned(cloud) @ view.T for cloud in (target, *(cloud for _, cloud in sources))]
    low, high = (end(np.concatenate(shown)[:, :2], axis=0) for end in (np.min, np.max))
    scale = (SIZE - 2 * MARGIN) / float((high - low).max())
    middle = (low + high) / 2
    dots = [_path((cloud[:, :2] - middle) * scale * [1, -1] + SIZE / 2) for cloud in shown]
    panels = [
        f'<g transform="translate({k * SIZE} 0)"><path class="target" d="{dots[0]}"/>'
        f'<path class="source" d="{dots[k + 1]}"/>'
        f'<text x="{SIZE / 2:g}" y="{SIZE + 12}" text-anchor="middle">{name}</text></g>'
        for k, (name, _) in enumerate(sources)
    ]
    names = " and ".join(name for name, _ in sources)
    return (
        f'<svg viewBox="0 0 {SIZE * len(sources)} {SIZE + 18}" role="img" '
        f'aria-label="the two clouds, {names}">{"".join(panels)}</svg>'
    )


def _view(cloud: Float64) -> Float64:
    """A rotation (3, 3) that lays the cloud's longest sides into the picture, then tilts it."""
    _, _, axes = np.linalg.svd(cloud - cloud.mean(0), full_matrices=False)
    axes[2] *= np.sign(np.linalg.det(axes))
    a, b = np.radians(TILT_DEG)
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    return np.asarray(about_x @ about_y @ axes)


def _thinned(cloud: Float64) -> Float64:
    """At most DOTS of the points (N, 3), evenly from their order, which is random."""
    return cloud[np.linspace(0, len(cloud) - 1, min(DOTS, len(cloud))).astype(int)]


def _path(points: Float64) -> str:
    """A dot at each point (N, 2): lines of no length, which round caps make visible."""
    return "".join(f"M{x:.1f} {y:.1f}h0" for x, y in points)
