"""Whoever is killed: every pair is in the output once, with the values of an undisturbed run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import dask
import numpy as np
import pytest
from batch_clouds import DeadlyFiles, assert_as_align, assert_same_rows, pairs_of, results
from distributed import Client, LocalCluster

import vnreg

# The bar is 10,000 pairs and three kills: VNREG_BATCH_PAIRS=10000 runs that, in minutes.
PAIRS = int(os.environ.get("VNREG_BATCH_PAIRS", "120"))
KILLS = 3


def test_a_killed_worker(clouds: list[Path], tmp_path: Path) -> None:
    pairs = pairs_of(clouds, 80)
    killed: list[int] = []
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs="CRITICAL"
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):

        def kill_one(_: vnreg.BatchReport) -> None:
            if not killed:
                killed.append(cluster.workers[0].pid)
                os.kill(killed[0], signal.SIGKILL)

        report = vnreg.batch(pairs, tmp_path, address=client, part_rows=8, progress=kill_one)
    assert killed and report.rows == 80 and report.parts == 10
    assert_as_align(results(tmp_path), pairs)


def test_a_pair_that_kills_its_workers_is_a_row(clouds: list[Path], tmp_path: Path) -> None:
    """And its neighbours, which die with it, are aligned all the same."""
    pairs = pairs_of(clouds, 12)
    pairs[5] = ("deadly://cloud.npy", pairs[5][1])
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs="CRITICAL"
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        client.register_plugin(DeadlyFiles())
        report = vnreg.batch(pairs, tmp_path, address=client, part_rows=4)
    rows = results(tmp_path)
    assert report.statuses["lost"] == 1 and report.rows == 12
    assert rows["row"].tolist() == list(range(12))
    assert rows["status"][5] == "lost" and "the workers that aligned it died" in rows["error"][5]
    assert rows.drop(index=5)["error"].isna().all()


def start(pairs: list[tuple[str, str]], output: Path) -> subprocess.Popen[bytes]:
    """A client with two workers, as a program of its own."""
    script = output.parent / "client.py"
    script.write_text(
        f"import vnreg\nif __name__ == '__main__':\n"
        f"    vnreg.batch({pairs!r}, {str(output)!r}, workers=2, part_rows=4)\n"
    )
    environment = os.environ | {"PYTHONPATH": str(Path(vnreg.__file__).parents[1])}
    return subprocess.Popen([sys.executable, script], env=environment, stderr=subprocess.DEVNULL)


def wait_for_parts(output: Path, count: int, client: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + 60 + PAIRS / 10
    while len(list(output.glob("part-*"))) < count:
        assert client.poll() is None, "the client ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_killed_client_is_resumed(clouds: list[Path], tmp_path: Path) -> None:
    pairs, output = pairs_of(clouds, PAIRS), tmp_path / "out"
    rng = np.random.default_rng(PAIRS)
    for kill in range(KILLS):
        client = start(pairs, output)
        before = len(list(output.glob("part-*")))
        share = PAIRS // 4 // (KILLS + 1)
        wait_for_parts(output, before + int(rng.integers(1, max(2, share))), client)
        client.send_signal(signal.SIGKILL)
        client.wait()
        (output / f".part-0-{kill}.parquet.0.tmp").write_bytes(b"what a worker had begun to write")
    done = len(list(output.glob("part-*")))
    report = vnreg.batch(pairs, output, workers=2, part_rows=4)
    assert 0 < done <= report.resumed_parts < PAIRS // 4
    assert report.resumed_parts + report.parts == PAIRS // 4
    assert not list(output.glob(".part-*"))
    assert_as_align(results(output), pairs)
    if PAIRS >= 1000:
        vnreg.batch(pairs, tmp_path / "undisturbed", workers=2, part_rows=4)
        assert_same_rows(results(output), results(tmp_path / "undisturbed"))


def test_an_output_of_other_pairs_or_settings_is_refused(
    client: Client, clouds: list[Path], tmp_path: Path
) -> None:
    pairs, output = pairs_of(clouds, 6), tmp_path / "out"
    vnreg.batch(pairs, output, address=client, part_rows=2)
    before = results(output)
    for option, value in (("seed", 1), ("part_rows", 3), ("mode", "coarse"), ("max_points", 99)):
        with pytest.raises(ValueError, match=f"made with other settings: {option}"):
            vnreg.batch(pairs, output, **{"address": client, "part_rows": 2, option: value})
    other = [*pairs[:3], pairs[0], *pairs[4:]]
    with pytest.raises(ValueError, match="is of other pairs than those given now"):
        vnreg.batch(other, output, address=client, part_rows=2)
    with pytest.raises(ValueError, match="has 2 parts more than these pairs make"):
        vnreg.batch(pairs[:2], output, address=client, part_rows=2)
    (output / "_vnreg.json").unlink()
    with pytest.raises(ValueError, match="has parts of unknown settings"):
        vnreg.batch(pairs, output, address=client, part_rows=2)
    assert_same_rows(before, results(output))


def test_appended_pairs_are_done(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    """The last part, which was short, is made anew; the others stay."""
    pairs = pairs_of(clouds, 11)
    for count, parts in ((5, 3), (9, 3), (11, 2), (11, 0)):
        report = vnreg.batch(pairs[:count], tmp_path, address=client, part_rows=2)
        assert report.parts == parts
        assert_as_align(results(tmp_path), pairs[:count])
    for changed in ([*pairs[:10], pairs[0]], [*pairs[:10], pairs[0], pairs[1]], pairs[:10]):
        with pytest.raises(ValueError, match="other pairs|parts more"):
            vnreg.batch(changed, tmp_path, address=client, part_rows=2)
    vnreg.batch(pairs[:1], tmp_path / "one", address=client)
    with pytest.raises(ValueError, match="other pairs"):
        vnreg.batch([], tmp_path / "one", address=client)


def test_nothing_is_started_for_a_bad_model_or_option(clouds: list[Path], tmp_path: Path) -> None:
    """Errors come at once, and no folder appears."""
    pairs, output = pairs_of(clouds, 1), tmp_path / "out"
    with pytest.raises(vnreg.Error, match="mode"):
        vnreg.batch(pairs, output, mode="best")  # type: ignore[arg-type]  # refused is what is tested
    with pytest.raises(vnreg.Error, match="max_points"):
        vnreg.batch(pairs, output, max_points=3)
    with pytest.raises(vnreg.Error):
        vnreg.batch(pairs, output, model=clouds[0])
    with pytest.raises(FileNotFoundError):
        vnreg.batch(pairs, output, model=tmp_path / "none.vnr")
    with pytest.raises(ValueError, match="workers: of the local cluster"):
        vnreg.batch(pairs, output, address="tcp://127.0.0.1:1", workers=2)
    assert not output.exists()


def test_an_output_that_cannot_be_written_ends_the_run(
    client: Client, clouds: list[Path], tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        vnreg.batch(pairs_of(clouds, 1), tmp_path / "file/out", address=client)


def test_a_cluster_may_be_used_again(client: Client, clouds: list[Path], tmp_path: Path) -> None:
    """A call leaves nothing behind on the workers of someone else's cluster."""
    pairs = pairs_of(clouds, 3)
    for name in ("a", "b"):
        vnreg.batch(pairs, tmp_path / name, address=client.scheduler.address)
    plugins = client.run(lambda dask_worker: list(dask_worker.plugins))
    assert not [name for names in plugins.values() for name in names if "vnreg" in name]
    assert_same_rows(results(tmp_path / "a"), results(tmp_path / "b"))
