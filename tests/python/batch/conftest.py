"""A cluster in this process, for all that does not need processes of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from batch_clouds import write_clouds
from distributed import Client


@pytest.fixture(scope="session")
def client() -> Iterator[Client]:
    """Two workers with one thread each; files of memory:// are theirs, too."""
    with Client(
        n_workers=2,
        threads_per_worker=1,
        processes=False,
        dashboard_address=":0",
        set_as_default=False,
    ) as client:
        yield client


@pytest.fixture(scope="session")
def clouds(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Scans of one object, one file each."""
    return write_clouds(tmp_path_factory.mktemp("clouds"), 12)
