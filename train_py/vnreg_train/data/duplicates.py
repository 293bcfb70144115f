"""Groups of near-duplicate models: one mesh in other colours, sizes, proportions or poses.

Every mesh is stretched to a unit cube and sampled; two models are compared over the 48 quarter
turns and mirrorings of the cube by the mean distance of nearest samples, divided by the same
distance between two samples of one model: 1 means "as equal as two samples of the same surface".
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist, pdist

from vnreg_train.data.catalog import stable_seed
from vnreg_train.data.mesh import Float64, Int64, Mesh, sample_surface, stretched_to_unit_box

SAMPLES = 2048
COARSE_SAMPLES = 96
RATIO_ANY = 1.25
RATIO_FAMILY = 1.6
HISTOGRAM_ANY = 0.10
HISTOGRAM_FAMILY = 0.20
FAMILY_LETTERS = 5
WORD_LETTERS = 4


def _cube_symmetries() -> Float64:
    """The 48 signed permutations of the axes, (48, 3, 3)."""
    turns = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            turn = np.zeros((3, 3))
            turn[range(3), order] = signs
            turns.append(turn)
    return np.stack(turns)


CUBE_SYMMETRIES = _cube_symmetries()


@dataclass(frozen=True)
class Fingerprint:
    """What of a model is compared: samples of its unit-cube form, and numbers about them."""

    path: str
    counts: tuple[int, int]
    points: Float64
    tree: cKDTree
    spacing: float
    histogram: Float64


def fingerprint(path: str, mesh: Mesh) -> Fingerprint:
    """Samples (2048, 3), their histogram of pair distances (D2) and mean spacing of a mesh."""
    stretched = stretched_to_unit_box(mesh)
    rng = np.random.default_rng(stable_seed("duplicates", path))
    points, others = (sample_surface(stretched, SAMPLES, rng) for _ in range(2))
    tree = cKDTree(points)
    counts, _ = np.histogram(pdist(points), bins=64, range=(0.0, 3.0**0.5))
    return Fingerprint(
        path=path,
        counts=(len(mesh.vertices), len(mesh.triangles)),
        points=points,
        tree=tree,
        spacing=float(tree.query(others)[0].mean()),
        histogram=counts / counts.sum(),
    )


def distance_ratio(a: Fingerprint, b: Fingerprint, give_up: float = 2.0) -> float:
    """Two-way chamfer distance of a and b over their spacing, at the best of 48 poses.

    Exact for ratios that matter; a pair whose coarse estimate exceeds `give_up` returns that.
    """
    moved = b.points[:COARSE_SAMPLES] @ CUBE_SYMMETRIES
    coarse = a.tree.query(moved.reshape(-1, 3))[0].reshape(48, -1).mean(axis=1) / a.spacing
    if coarse.min() > give_up:
        return float(coarse.min())
    ratios = []
    for turn in CUBE_SYMMETRIES[np.argsort(coarse, kind="stable")[:4]]:
        forth = a.tree.query(b.points @ turn)[0].mean() / a.spacing
        back = b.tree.query(a.points @ turn.T)[0].mean() / b.spacing
        ratios.append(max(float(forth), float(back)))
    return min(ratios)


def _words(stem: str) -> set[str]:
    """Lower-case words of four or more letters and digits in a name, also in camelCase."""
    parts = re.findall(r"[A-Z]?[a-z0-9]+|[A-Z0-9]+", stem)
    return {part.lower() for part in parts if len(part) >= WORD_LETTERS}


def is_family(a: str, b: str) -> bool:
    """Whether two model paths of one archive folder share a word or their first five letters."""
    one, two = PurePosixPath(a), PurePosixPath(b)
    alike = one.stem[:FAMILY_LETTERS].lower() == two.stem[:FAMILY_LETTERS].lower()
    return one.parts[0] == two.parts[0] and (alike or bool(_words(one.stem) & _words(two.stem)))


def _candidates(prints: Sequence[Fingerprint]) -> list[tuple[int, int, bool]]:
    """Pairs (i, j, family) worth comparing: similar pair distances, or equal mesh sizes."""
    histograms = np.stack([one.histogram for one in prints])
    apart: Float64 = cdist(histograms, histograms, "cityblock")
    pairs = []
    for i, j in np.argwhere(np.triu(apart < max(HISTOGRAM_FAMILY, HISTOGRAM_ANY), 1)):
        family = is_family(prints[i].path, prints[j].path)
        same_size = prints[i].counts == prints[j].counts
        if family or same_size or apart[i, j] < HISTOGRAM_ANY:
            pairs.append((int(i), int(j), family))
    return pairs


def duplicate_groups(prints: Sequence[Fingerprint]) -> Int64:
    """Group number (M,) of every model; near-duplicates, also over a chain, share one.

    Pairs of one family (see is_family) are joined up to a distance ratio of 1.6, others up to
    1.25. Groups are numbered by their first member.
    """
    parent = list(range(len(prints)))

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for i, j, family in _candidates(prints):
        if root(i) == root(j):
            continue
        limit = RATIO_FAMILY if family else RATIO_ANY
        if distance_ratio(prints[i], prints[j]) < limit:
            low, high = sorted((root(i), root(j)))
            parent[high] = low
    roots: NDArray[np.int64] = np.array([root(i) for i in range(len(prints))], dtype=np.int64)
    return np.unique(roots, return_inverse=True)[1].astype(np.int64)
