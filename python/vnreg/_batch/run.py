"""One call of vnreg.batch: from pairs to part files, with a bounded number of parts on the way."""

from __future__ import annotations

import logging
import time
import uuid
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from typing import Any

import fsspec
from distributed import Client, Future, KilledWorker, LocalCluster, as_completed

import vnreg
from vnreg._batch import BatchReport
from vnreg._batch.blocks import Block, blocks_of
from vnreg._batch.output import OutputFolder
from vnreg._batch.pairs import folder_of, read_pairs
from vnreg._batch.rows import Row, failed_row
from vnreg._batch.worker import LoadedModel, Task, load_model

PARTS_PER_THREAD = 2
"""In flight: one that is worked on, one that waits beside it."""
LOOK_AT_CLUSTER_S = 5.0
"""How often the number of its threads, which may change, is asked for."""


@dataclass(frozen=True)
class Job:
    """What is done to each pair."""

    model: bytes | None
    options: dict[str, Any]
    part_rows: int
    read_attempts: int

    @staticmethod
    def of(*, model: Any, part_rows: int, read_attempts: int, **options: Any) -> Job:
        """Reads the model. Raises Error, OSError, ValueError before anything is started."""
        content = None
        if model is not None:
            with fsspec.open(str(model), "rb") as file:
                content = file.read()
        vnreg.Registrar(load_model(content), **options)
        for name, value in (("part_rows", part_rows), ("read_attempts", read_attempts)):
            if value < 1:
                raise ValueError(f"{name}: expected 1 or more, got {value}")
        return Job(content, options, part_rows, read_attempts)

    def settings(self) -> dict[str, Any]:
        """What the values and names of the parts depend on."""
        return {
            "vnreg": vnreg.__version__,
            "model": "built-in" if self.model is None else sha256(self.model).hexdigest(),
            "part_rows": self.part_rows,
            **self.options,
        }


def run(
    pairs: Any,
    output: str,
    job: Job,
    *,
    address: str | Client | None,
    workers: int | None,
    in_flight: int | None,
    progress: Callable[[BatchReport], None] | None,
) -> BatchReport:
    """See vnreg.batch."""
    if in_flight is not None and in_flight < 1:
        raise ValueError(f"in_flight: expected 1 or more, got {in_flight}")
    if address is not None and workers is not None:
        raise ValueError("workers: of the local cluster; expected None beside an address")
    started = time.monotonic()
    report = BatchReport()
    folder = OutputFolder.open(output, job.settings())
    with connected(address, workers) as client, loaded(client, job) as plugin:
        task = Task(plugin, folder, job.read_attempts)
        compute = partial(_computed, client)
        blocks = blocks_of(read_pairs(pairs, compute), job.part_rows, folder_of(pairs))
        limit = _Limit(client, in_flight)
        for statuses in _done(client, task, _missing(blocks, folder, report), limit, report):
            report.parts += 1
            report.rows += statuses.total()
            report.statuses = dict(Counter(report.statuses) + statuses)
            report.seconds = time.monotonic() - started
            if progress is not None:
                progress(report)
    folder.remove_leftovers()
    report.seconds = time.monotonic() - started
    return report


@contextmanager
def connected(address: str | Client | None, workers: int | None) -> Iterator[Client]:
    """The client of a cluster; of one in processes of this machine where no address is given."""
    if isinstance(address, Client):
        yield address
    elif address is not None:
        with Client(address, set_as_default=False) as client:
            yield client
    else:
        with (
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=":0",
                silence_logs=logging.CRITICAL,
            ) as cluster,
            Client(cluster, set_as_default=False) as client,
        ):
            yield client


@contextmanager
def loaded(client: Client, job: Job) -> Iterator[str]:
    """Loads the model on every worker; the name under which they have it."""
    name = f"vnreg-batch-{uuid.uuid4().hex}"
    client.register_plugin(LoadedModel(name, job.model, job.options), name=name)
    try:
        yield name
    finally:
        client.unregister_worker_plugin(name)


def _computed(client: Client, frame: Any) -> Any:
    """A Dask partition as pandas frame, computed before the parts that wait."""
    return client.compute(frame, priority=1).result()


def _missing(blocks: Iterable[Block], folder: OutputFolder, report: BatchReport) -> Iterator[Block]:
    """The blocks without a part. ValueError where the folder has parts of other pairs."""
    parts = folder.parts()
    for block in blocks:
        found = parts.pop(block.number, None)
        if found is None:
            yield block
        elif found == block.file_name:
            report.resumed_parts += 1
        elif not parts and folder.begins(found, block):  # the last part, and rows were appended
            folder.remove(found)
            yield block
        else:
            raise ValueError(f"{folder.url}: {found} is of other pairs than those given now")
    if parts:
        raise ValueError(f"{folder.url}: has {len(parts)} parts more than these pairs make")


class _Limit:
    """How many parts may be in flight."""

    def __init__(self, client: Client, fixed: int | None) -> None:
        self._client = client
        self._fixed = fixed
        self._value = 1
        self._looked = float("-inf")

    def value(self) -> int:
        if self._fixed is not None:
            return self._fixed
        if time.monotonic() - self._looked > LOOK_AT_CLUSTER_S:
            self._looked = time.monotonic()
            self._value = max(1, PARTS_PER_THREAD * sum(self._client.nthreads().values()))
        return self._value


def _done(
    client: Client, task: Task, blocks: Iterable[Block], limit: _Limit, report: BatchReport
) -> Iterator[Counter[str]]:
    """Does the blocks, a bounded number at a time; the statuses of each when it is committed.

    A block whose workers died again and again comes at the end, alone, pair by pair: so none is
    blamed for what its neighbour did.
    """
    running: dict[Future[Any], Block] = {}
    finished = as_completed(loop=client.loop)
    suspects: list[Block] = []

    def next_one() -> Iterator[Counter[str]]:
        future = next(finished)
        block = running.pop(future)
        try:
            statuses = future.result()
        except KilledWorker:
            suspects.append(block)
        else:
            yield statuses

    for block in blocks:
        future = client.submit(task.align_and_commit, block, pure=False, retries=2)
        running[future] = block
        finished.add(future)
        report.most_in_flight = max(report.most_in_flight, len(running))
        while len(running) >= limit.value():
            yield from next_one()
    while running:
        yield from next_one()
    for block in suspects:
        yield task.commit(block, [_alone(client, task, block, i) for i in range(len(block.pairs))])


def _alone(client: Client, task: Task, block: Block, index: int) -> Row:
    """The row of one pair of a block, aligned while nothing else is."""
    number, pair = block.first_row + index, block.pairs[index]
    single = replace(block, first_row=number, pairs=(pair,))
    try:
        rows: list[Row] = client.submit(task.align, single, pure=False).result()
        return rows[0]
    except KilledWorker as error:
        return failed_row(number, pair, "lost", f"the workers that aligned it died: {error}")
