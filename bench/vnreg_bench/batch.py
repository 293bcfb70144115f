"""vnreg.batch with one and two worker processes, and what a plan for many pairs is made of."""

from __future__ import annotations

import logging
import os
import resource
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from distributed import Client, LocalCluster

import vnreg
from vnreg._batch.blocks import blocks_of
from vnreg._batch.pairs import read_pairs
from vnreg_bench.inputs import bent_box
from vnreg_bench.settings import Settings
from vnreg_bench.timing import interleaved, summary

POINTS = 1024
CLOUD_PAIRS = 40
PART_ROWS = 30
EMPTY_PARTS = 200
LARGE_PART_ROWS = 1000
TABLE_ROWS = 200_000

Pairs = list[tuple[str, str]]


def batch(settings: Settings) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        pairs = write_pairs(folder, settings.batch_pairs)
        with cluster(1) as one, cluster(2) as two:
            clients = {"1": one, "2": two}
            work = {
                workers: lambda client=client: milliseconds(pairs, folder, client)
                for workers, client in clients.items()
            }
            times = interleaved(work, settings.batch_rounds)
            part_ms = ms_per_part(folder, one)
            row_bytes = bytes_per_row(folder, two)
        client = client_speed(folder)
    ratios = [a / b for a, b in zip(times["1"], times["2"], strict=True)]
    return {
        "points": POINTS,
        "pairs": settings.batch_pairs,
        "part_rows": PART_ROWS,
        "ms": {workers: summary(of) for workers, of in times.items()},
        "gain": summary(ratios),
        "part_ms": part_ms,
        "row_bytes": row_bytes,
        "client": client,
    }


def write_pairs(folder: Path, count: int) -> Pairs:
    """Files of CLOUD_PAIRS different pairs, in turns."""
    for seed in range(CLOUD_PAIRS):
        for side, cloud in zip("st", bent_box(POINTS, seed), strict=True):
            np.save(folder / f"{side}{seed}.npy", cloud)
    paths = [tuple(str(folder / f"{side}{i}.npy") for side in "st") for i in range(CLOUD_PAIRS)]
    return [(paths[i % CLOUD_PAIRS][0], paths[i % CLOUD_PAIRS][1]) for i in range(count)]


@contextmanager
def cluster(workers: int) -> Iterator[Client]:
    """Worker processes, each on a processor of its own."""
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,
        ) as local,
        Client(local, set_as_default=False) as client,
    ):
        cores = sorted(os.sched_getaffinity(0))[-workers:]
        for core, address in zip(cores, sorted(client.nthreads()), strict=True):
            client.run(os.sched_setaffinity, 0, {core}, workers=[address])
        yield client


def milliseconds(pairs: Pairs, folder: Path, client: Client, part_rows: int = PART_ROWS) -> float:
    """Of one call that does all pairs, into a new folder."""
    with tempfile.TemporaryDirectory(dir=folder) as output:
        report = vnreg.batch(pairs, output, address=client, part_rows=part_rows)
    assert report.rows == len(pairs)
    return 1e3 * report.seconds


def ms_per_part(folder: Path, client: Client) -> float:
    """What a part costs beside its pairs: parts of one row without a cloud."""
    nothing: Any = [(None, None)] * EMPTY_PARTS
    return milliseconds(nothing, folder, client, part_rows=1) / EMPTY_PARTS


def bytes_per_row(folder: Path, client: Client) -> float:
    """In a part file of many rows, no two of the same clouds."""
    output = folder / "one_part"
    names = [str(folder / f"{i:09d}.npy") for i in range(LARGE_PART_ROWS + 1)]
    for seed, name in enumerate(names):
        np.save(name, bent_box(32, seed)[0])
    pairs = list(zip(names, names[1:], strict=False))
    vnreg.batch(pairs, output, address=client, part_rows=len(pairs))
    (part,) = output.glob("part-*")
    return part.stat().st_size / len(pairs)


def client_speed(folder: Path) -> dict[str, float]:
    """Pairs per second that the client makes parts of, from a table; and what memory that takes."""
    names = [f"s3://bucket/scans/{i % 997:04d}/{i:09d}.ply" for i in range(TABLE_ROWS)]
    table = folder / "table.parquet"
    pa.parquet.write_table(pa.table({"source": names, "target": names[::-1]}), table)
    del names
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    started = time.perf_counter()
    parts = [
        block.file_name for block in blocks_of(read_pairs(table, lambda part: part), 10_000, "")
    ]
    elapsed = time.perf_counter() - started
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "pairs_per_s": TABLE_ROWS / elapsed,
        "parts": len(parts),
        "grown_mb": (after - before) / 1024,
    }
