"""A batch that is killed in its midst, again and again, and goes on.

`make batch-kills` runs it with 10,000 pairs; VNREG_BATCH_PAIRS sets how many.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_tables import FORMATS, read_rows, without_ms, write_clouds, write_pairs
from numpy.typing import NDArray

PAIRS = int(os.environ.get("VNREG_BATCH_PAIRS", "300"))
KILLS = 3
SETTINGS = ("--threads", "2", "--max-points", "64")


def rows_in(path: Path) -> int:
    """How many lines have their end."""
    return path.read_bytes().count(b"\n") if path.exists() else 0


def run_batch(program_path: Path, pairs: Path, output: Path) -> dict[str, Any]:
    """Runs to the end, which may take minutes; the summary."""
    command = [program_path, "batch", pairs, "-o", output, "--json", *SETTINGS]
    done = subprocess.run(command, capture_output=True, check=True)
    summary: dict[str, Any] = json.loads(done.stdout)
    return summary


def kill_at(program_path: Path, pairs: Path, output: Path, journal: Path, rows: int) -> int:
    """Starts the run and kills it as soon as it has that many rows; how many it leaves."""
    command = [program_path, "batch", pairs, "-o", output, *SETTINGS]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    while rows_in(journal) < rows and process.poll() is None:
        time.sleep(0.001)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL, "it ended before it was killed"
    return rows_in(journal)


@pytest.mark.parametrize("ending", FORMATS)
def test_a_batch_killed_three_times(
    program_path: Path,
    shape: NDArray[np.float64],
    tmp_path: Path,
    ending: str,
) -> None:
    pairs = tmp_path / "pairs.csv"
    write_pairs(pairs, write_clouds(tmp_path, shape, 40), PAIRS)
    undisturbed = tmp_path / f"undisturbed.{ending}"
    run_batch(program_path, pairs, undisturbed)

    output = tmp_path / f"killed.{ending}"
    journal = tmp_path / "killed.parquet.rows.jsonl" if ending == "parquet" else output
    left = 0
    for instant in sorted(np.random.default_rng(KILLS).uniform(0.05, 0.9, KILLS)):
        rows = kill_at(program_path, pairs, output, journal, int(instant * PAIRS))
        assert rows >= left, "rows were lost"
        left = rows
    summary = run_batch(program_path, pairs, output)
    header = 1 if ending == "csv" else 0
    assert 0 < summary["done_before"] == left - header < PAIRS

    rows = read_rows(output)
    assert [row["row"] for row in rows] == list(range(PAIRS))
    assert without_ms(rows) == without_ms(read_rows(undisturbed))
    assert sum(row["status"] == "unreadable" for row in rows) == PAIRS // 50
    print(f"{ending}: {PAIRS} rows, killed at {KILLS} instants, {left} rows then")
