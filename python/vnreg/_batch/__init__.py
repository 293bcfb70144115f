"""vnreg.batch: many pairs, on the cores of this machine or of a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from distributed import Client


@dataclass
class BatchReport:
    """What a call of batch() did, or has done so far.

    rows: pairs that it did, failed ones included; statuses: the same by their status.
    parts: part files that it wrote; resumed_parts: those that an earlier call had left complete.
    most_in_flight: the largest number of parts that the cluster held at a time.
    seconds: wall-clock time since the start of the call.
    """

    rows: int = 0
    parts: int = 0
    resumed_parts: int = 0
    statuses: dict[str, int] = field(default_factory=dict)
    most_in_flight: int = 0
    seconds: float = 0.0


def batch(
    pairs: str | os.PathLike[str] | Iterable[Any] | Any,
    output: str | os.PathLike[str],
    *,
    address: str | Client | None = None,
    workers: int | None = None,
    model: str | os.PathLike[str] | None = None,
    mode: Literal["coarse", "paper", "verified"] = "verified",
    max_points: int = 0,
    seed: int = 0,
    drop_non_finite: bool = False,
    part_rows: int = 100,
    in_flight: int | None = None,
    read_attempts: int = 4,
    progress: Callable[[BatchReport], None] | None = None,
) -> BatchReport:
    """Aligns every pair once and writes one row for each into a folder of parquet files.

    pairs: an iterable of (source, target) or (source, target, id), each cloud a path, a URL of
    fsspec or what align takes; or a table with the columns source, target and, if you like, id: a
    pandas or Dask DataFrame, or the path or URL of a CSV or parquet file (or folder). Iterables and
    tables are read as the work goes on, never as a whole.
    output: folder, path or URL. Its files part-NUMBER-HASH.parquet hold `part_rows` rows each, in
    the order of the pairs, and appear complete or not at all. Called again after it was killed,
    batch does what is missing, rows appended to the pairs included. It refuses a folder of other
    pairs or other settings (ValueError).

    address: of a Dask scheduler, or a Client; None starts `workers` processes here (default: one
    per core), for the time of the call.
    model: path or URL of a `.vnr` file, loaded once per worker; None means the built-in one.
    mode, max_points, seed, drop_non_finite: as of Registrar. Neither they nor the values in the
    rows depend on the number of workers or on part_rows.
    in_flight: parts given to the cluster and not yet done, at most; default two per thread of it.
    read_attempts: for errors of reading that may pass, with pauses that double from 0.1 s.
    progress: called after each part.

    A pair that cannot be read or aligned is a row with its status and error and stops nothing; see
    docs/batch.md for the columns. Raises ImportError without `pip install vnreg[batch]`, Error for
    a bad model or option, OSError where the output cannot be written. In a script, call it below
    `if __name__ == "__main__":`, because the worker processes import the script.
    """
    try:
        from vnreg._batch.run import Job, run
    except ModuleNotFoundError as error:
        raise ImportError(f"vnreg.batch needs pip install 'vnreg[batch]': {error}") from error
    job = Job.of(
        model=model,
        mode=mode,
        max_points=max_points,
        seed=seed,
        drop_non_finite=drop_non_finite,
        part_rows=part_rows,
        read_attempts=read_attempts,
    )
    return run(
        pairs,
        os.fspath(output),
        job,
        address=address,
        workers=workers,
        in_flight=in_flight,
        progress=progress,
    )
