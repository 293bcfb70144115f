"""Other registration programs as methods, with the grids that their settings are chosen from.

The chosen settings stand in tuned_peers.json beside this file, written by `vnreg-train
tune-peers`: on validation pairs, by recall up to symmetry (vnreg_train.evaluate.tune). The file
also lists what was tried outside the grids as they are now: they were narrowed towards what did
best.
"""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from vnreg_train.data.mesh import Float64
from vnreg_train.data.protocol import Pair
from vnreg_train.evaluate.estimates import Estimate

TUNED = Path(__file__).with_name("tuned_peers.json")
Settings = Mapping[str, Any]


@dataclass(frozen=True)
class Peer:
    """A program: its function in peer_registrations, what it is made of, and its grid."""

    function: str
    packages: tuple[str, ...]
    grid: Mapping[str, tuple[Any, ...]]

    def settings(self) -> Iterator[dict[str, Any]]:
        """Every point of the grid."""
        for values in itertools.product(*self.grid.values()):
            yield dict(zip(self.grid, values, strict=True))


PEERS = {
    "open3d_ransac_icp": Peer(
        "open3d_ransac",
        ("open3d-cpu",),
        {
            "normal_radius": (0.07, 0.1),
            "feature_radius": (0.15, 0.25),
            "inlier_distance": (0.03,),
            "mutual_filter": (True,),
            "icp_distance": (0.06,),
        },
    ),
    "open3d_fgr_icp": Peer(
        "open3d_fgr",
        ("open3d-cpu",),
        {
            "normal_radius": (0.07, 0.1),
            "feature_radius": (0.15, 0.25),
            "inlier_distance": (0.03,),
            "tuple_test": (False, True),
            "icp_distance": (0.06,),
        },
    ),
    "kiss_matcher_icp": Peer(
        "kiss_matcher_icp",
        ("kiss-matcher", "open3d-cpu"),
        {
            "voxel_size": (0.015, 0.02, 0.03),
            "sampling": (False, True),
            "normal_gain": (3.0,),
            "feature_gain": (5.0, 8.0),
            "noise_gain": (1.0,),
            "icp_distance": (0.06,),
        },
    ),
    "small_gicp": Peer(
        "small_gicp_align",
        ("small_gicp",),
        {
            "kind": ("ICP", "PLANE_ICP", "GICP"),
            "start": ("identity", "centroids"),
            "correspondence_distance": (0.3, 1.0),
            "downsampling": (0.01,),
        },
    ),
}


class PeerMethod:
    """A peer with one choice of settings."""

    def __init__(self, name: str, settings: Settings) -> None:
        from vnreg_train.evaluate import peer_registrations

        self.name, self._settings = name, dict(settings)
        self._function: Callable[..., Float64 | None] = getattr(
            peer_registrations, PEERS[name].function
        )

    def identity(self) -> dict[str, Any]:
        """Versions and settings."""
        packages = {package: version(package) for package in PEERS[self.name].packages}
        return {"peer": self.name, "packages": packages, "settings": self._settings}

    def estimate(self, pair: Pair) -> Estimate:
        """What the peer cannot register it answers without a pose."""
        source, target = pair.source.astype(np.float64), pair.target.astype(np.float64)
        start = time.process_time()
        try:
            pose = self._function(source, target, **self._settings)
        except RuntimeError:
            pose = None
        ms = 1000 * (time.process_time() - start)
        return Estimate(pose, ms, "ok" if pose is not None else "no_pose")


def tuned_peer(name: str, path: Path = TUNED) -> PeerMethod:
    """The peer with its chosen settings. Raises KeyError for one that was not tuned."""
    content = json.loads(path.read_text(encoding="utf-8"))
    return PeerMethod(name, content["peers"][name]["chosen"])
