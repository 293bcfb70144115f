"""Reading the clouds of a block ahead of their alignment."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import fsspec
import numpy as np
from numpy.typing import NDArray

from vnreg._batch.pairs import Cloud, Pair
from vnreg._vnreg import parse_cloud

Points = NDArray[Any]

READERS = 8
"""Threads of a worker that read while it aligns: object stores answer after tens of ms."""
PAIRS_AHEAD = 8
"""Pairs of a worker whose clouds are in memory, at most, and the one that it aligns."""
CLOUDS_KEPT = 8
"""Of a block: many sources to one target read that once."""
FIRST_PAUSE_S = 0.1

# Trying again does not help against these.
PERMANENT = (
    FileNotFoundError,
    IsADirectoryError,
    NotADirectoryError,
    PermissionError,
    ImportError,
    MemoryError,
    TypeError,
    ValueError,
)


class UnreadableCloud(Exception):
    """A cloud cannot be had; the text is one for the column `error`."""


def read_ahead(
    pairs: Sequence[Pair], folder: str, attempts: int
) -> Iterator[tuple[Points, Points] | UnreadableCloud]:
    """Source and target of each pair, in order, or why they are not to be had."""
    read = lru_cache(CLOUDS_KEPT)(lambda path: read_points(path, folder, attempts))

    def both(pair: Pair) -> tuple[Points, Points] | UnreadableCloud:
        try:
            return _points(pair.source, read), _points(pair.target, read)
        except UnreadableCloud as error:
            return error

    waiting: deque[Future[tuple[Points, Points] | UnreadableCloud]] = deque()
    with ThreadPoolExecutor(READERS) as pool:
        for pair in pairs:
            waiting.append(pool.submit(both, pair))
            if len(waiting) > PAIRS_AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def _points(cloud: Cloud, read: Callable[[str], Points]) -> Points:
    if cloud is None:
        raise UnreadableCloud("expected a path, found nothing")
    return read(cloud) if isinstance(cloud, str) else cloud


def read_points(path: str, folder: str, attempts: int) -> Points:
    """The points (N, 3) of a path or URL. Raises UnreadableCloud."""
    try:
        content = read_content(absolute(path, folder), attempts)
        return np.asarray(parse_cloud(content, os.path.splitext(path)[1]))
    except ValueError as error:
        raise UnreadableCloud(f"{path}: {error}") from None
    except Exception as error:  # what the packages of fsspec raise is of any type
        found = getattr(error, "strerror", None) or f"{type(error).__name__}: {error}"
        message = f"{path}: expected a file that can be read, found {found}"
        raise UnreadableCloud(message) from None


def absolute(path: str, folder: str) -> str:
    return path if "://" in path or os.path.isabs(path) else f"{folder}/{path}"


def read_content(url: str, attempts: int) -> bytes:
    """The bytes of a file; errors that may pass are waited for."""
    for attempt in range(1, attempts + 1):
        try:
            files, path = fsspec.url_to_fs(url)
            return bytes(files.cat_file(path))
        except PERMANENT:
            raise
        except Exception:  # see above
            if attempt == attempts:
                raise
            time.sleep(FIRST_PAUSE_S * 2 ** (attempt - 1))
    raise ValueError(f"read_attempts: expected 1 or more, got {attempts}")
