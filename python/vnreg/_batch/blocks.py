"""Pairs grouped into what one task does and one part file holds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b

import numpy as np

from vnreg._batch.pairs import Cloud, Pair

MAX_BYTES = 8 << 20
"""Of the points that travel with a block; pairs of paths have none."""


@dataclass(frozen=True)
class Block:
    number: int
    first_row: int
    folder: str
    """Where relative paths begin."""
    pairs: tuple[Pair, ...]

    @cached_property
    def file_name(self) -> str:
        """The same for the same pairs at the same place, and for nothing else."""
        return f"part-{self.number:08d}-{self._digest()}.parquet"

    def _digest(self) -> str:
        digest = blake2b(f"{self.first_row} {self.folder}".encode(), digest_size=8)
        for pair in self.pairs:
            for value in pair:
                content = _bytes_of(value)
                digest.update(f"{type(value).__name__} {len(content)} ".encode())
                digest.update(content)
        return digest.hexdigest()


def blocks_of(pairs: Iterable[Pair], rows: int, folder: str) -> Iterator[Block]:
    """Consecutive pairs, `rows` in each block, or fewer where their points are MAX_BYTES."""
    number = first_row = size = 0
    waiting: list[Pair] = []
    for pair in pairs:
        waiting.append(pair)
        size += sum(cloud.nbytes for cloud in pair[:2] if isinstance(cloud, np.ndarray))
        if len(waiting) == rows or size >= MAX_BYTES:
            yield Block(number, first_row, folder, tuple(waiting))
            number, first_row = number + 1, first_row + len(waiting)
            waiting, size = [], 0
    if waiting or number == 0:  # no pairs at all make one part without rows
        yield Block(number, first_row, folder, tuple(waiting))


def _bytes_of(value: Cloud) -> bytes:
    if isinstance(value, np.ndarray):
        return f"{value.dtype.str}{value.shape}".encode() + value.tobytes()
    return (value or "").encode("utf-8", "surrogateescape")
