"""`vnreg batch`: one row a pair in three formats, whatever the pairs and the tables are like."""

from __future__ import annotations

import errno
import json
import os
import resource
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

import jsonschema
import numpy as np
import pyarrow.parquet as pq
import pytest
from cli_program import FAILURE, INPUT, OK, USAGE, Program, Run, repository
from cli_tables import COLUMNS, FORMATS, QUICK, read_rows, without_ms, write_clouds, write_pairs
from numpy.typing import NDArray

SCHEMAS = repository / "docs" / "schemas"
INTERRUPTED = 130


@pytest.fixture()
def pairs(shape: NDArray[np.float64], tmp_path: Path) -> Path:
    """A table of 60 pairs in a folder of their own."""
    folder = tmp_path / "clouds"
    folder.mkdir()
    write_pairs(folder / "pairs.csv", write_clouds(folder, shape, 12), 60)
    return folder / "pairs.csv"


@pytest.mark.parametrize("ending", FORMATS)
def test_every_pair_has_its_row(vnreg: Program, pairs: Path, tmp_path: Path, ending: str) -> None:
    output = tmp_path / f"results.{ending}"
    summary = vnreg("batch", pairs, "-o", output, "--json", "--threads", "2", *QUICK).json()
    jsonschema.validate(summary, json.loads((SCHEMAS / "batch_summary.schema.json").read_text()))
    assert (summary["pairs"], summary["done"], summary["done_before"]) == (60, 60, 0)
    rows = read_rows(output)
    assert [row["row"] for row in rows] == list(range(60))
    assert [row["id"] for row in rows] == [f"pair {i}" for i in range(60)]
    statuses = [row["status"] for row in rows]
    assert summary["statuses"] == {status: statuses.count(status) for status in set(statuses)}
    for row in rows[:49]:
        assert row["status"] == "ok" and row["error"] is None and row["ms"] > 0
        source, target = (pairs.parent / row[name] for name in ("source", "target"))
        alone = vnreg("align", source, target, "--json", *QUICK).json() if row["row"] < 3 else None
        if alone:
            assert row["T_target_source"] == sum(alone["T_target_source"], [])
            for name in ("confidence", "overlap", "rmse", "score", "points_source"):
                assert row[name] == alone[name]
    missing = rows[49]
    assert (missing["status"], missing["T_target_source"]) == ("unreadable", None)
    path = pairs.parent / "missing.ply"
    found = "expected a file that can be read, found No such file or directory"
    assert missing["error"] == f"{path}: {found}"


def test_the_formats_say_the_same(vnreg: Program, pairs: Path, tmp_path: Path) -> None:
    tables = []
    for ending in FORMATS:
        output = tmp_path / f"results.{ending}"
        assert vnreg("batch", pairs, "-o", output, *QUICK).code == OK
        tables.append(without_ms(read_rows(output)))
    assert tables[0] == tables[1] == tables[2]


def test_lines_follow_the_schema(vnreg: Program, pairs: Path, tmp_path: Path) -> None:
    output = tmp_path / "results.jsonl"
    folder = pairs.parent
    (folder / "few.xyz").write_text("1 2 3\n4 5 6\n")
    (folder / "equal.xyz").write_text("1 2 3\n" * 100)
    (folder / "nan.xyz").write_text("1 2 nan\n" * 100)
    with pairs.open("a") as table:
        for name in ("few", "equal", "nan"):
            table.write(f"{name},{name}.xyz,cloud_000.npy\n")
    assert vnreg("batch", pairs, "-o", output, *QUICK).code == OK
    schema = json.loads((SCHEMAS / "batch_row.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    rows = read_rows(output)
    for row in rows:
        jsonschema.validate(row, schema)
    assert [row["status"] for row in rows[-3:]] == ["too_few_points", "degenerate", "not_finite"]
    assert all(" expected " in row["error"] for row in rows[-3:])
    assert list(schema["properties"]) == COLUMNS


def test_the_result_does_not_depend_on_the_threads(
    vnreg: Program, pairs: Path, tmp_path: Path
) -> None:
    tables = []
    for threads in ("1", "2", "5"):
        output = tmp_path / f"{threads}.csv"
        arguments = ("--threads", threads, "--max-points", "64")
        assert vnreg("batch", pairs, "-o", output, *arguments).code == OK
        tables.append(without_ms(read_rows(output)))
    assert tables[0] == tables[1] == tables[2]


def test_parquet_of_more_than_one_row_group(
    vnreg: Program, shape: NDArray[np.float64], tmp_path: Path
) -> None:
    names = write_clouds(tmp_path, shape, 1)
    rows = [f"{names[0]},none.ply" for _ in range(16_384 + 100)]
    rows[5] = f"{names[0]},{names[0]}"
    (tmp_path / "pairs.csv").write_text("\n".join(rows))
    output = tmp_path / "results.parquet"
    assert vnreg("batch", tmp_path / "pairs.csv", "-o", output, *QUICK).code == OK
    file = pq.ParquetFile(output)
    assert [file.metadata.row_group(i).num_rows for i in range(2)] == [16_384, 100]
    found = read_rows(output)
    assert [row["row"] for row in found] == list(range(16_484))
    assert [row["row"] for row in found if row["T_target_source"]] == [5]
    assert json.loads(file.schema_arrow.metadata[b"vnreg"])["mode"] == "coarse"


# ---- tables ----


def ids_and_sources(vnreg: Program, table: Path, output: Path) -> list[tuple[str, str]]:
    assert vnreg("batch", table, "-o", output, *QUICK).code == OK
    return [(row["id"], row["source"]) for row in read_rows(output)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a.npy,b.npy\nb.npy,a.npy\n", [("0", "a.npy"), ("1", "b.npy")]),
        ("target,id,note,source\nb.npy,7,,a.npy\n", [("7", "a.npy")]),
        ('\ufeffsource,target\r\n"a,""1"".npy",b.npy\r\n\r\n', [("0", 'a,"1".npy')]),
        ("source,target\na.npy,b.npy\na.npy,b.npy\n", [("0", "a.npy"), ("1", "a.npy")]),
        ("source,target\n", []),
        ("", []),
        ("  x.npy ,b.npy", [("0", "  x.npy ")]),
    ],
    ids=["no header", "any order", "quotes", "twice", "no rows", "empty", "blanks"],
)
@pytest.mark.parametrize("ending", FORMATS)
def test_tables(
    vnreg: Program, tmp_path: Path, text: str, expected: list[tuple[str, str]], ending: str
) -> None:
    (tmp_path / "pairs.csv").write_text(text)
    found = ids_and_sources(vnreg, tmp_path / "pairs.csv", tmp_path / f"results.{ending}")
    assert found == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"source,file\na,b\n", "line 1: expected the columns source and target, found source"),
        (b"source,target\na,b\na\n", "line 3: expected a target in column 2, found none"),
        (b"source,target\n,b\n", "line 2: expected a source in column 1, found none"),
        (b'a,"b\nc\n', "line 1: expected comma-separated fields, found a quote out of place"),
        (b'"a"x,b\n', "line 1: expected comma-separated fields, found a quote out of place"),
    ],
)
def test_broken_tables(vnreg: Program, tmp_path: Path, text: bytes, message: str) -> None:
    table, output = tmp_path / "pairs.csv", tmp_path / "results.csv"
    table.write_bytes(text)
    assert vnreg("batch", table, "-o", output).error(INPUT).startswith(f"{table}: {message}")
    assert not output.exists()


def test_a_table_that_is_not_there(vnreg: Program, tmp_path: Path) -> None:
    message = vnreg("batch", tmp_path / "none.csv", "-o", tmp_path / "r.csv").error(INPUT)
    assert message.startswith(f"{tmp_path / 'none.csv'}: expected a file that can be read")


def test_a_table_from_standard_input_is_relative_to_the_working_folder(
    program_path: Path, pairs: Path, tmp_path: Path
) -> None:
    command = [program_path, "batch", "-", "-o", tmp_path / "results.csv", *QUICK]
    run = subprocess.run(
        command, input=pairs.read_bytes(), cwd=pairs.parent, capture_output=True, check=True
    )
    assert run.stderr == b""
    rows = read_rows(tmp_path / "results.csv")
    assert [row["status"] for row in rows[:3]] == ["ok"] * 3
    assert rows[49]["error"].startswith("missing.ply: ")


@pytest.mark.parametrize("ending", FORMATS)
def test_names_that_are_no_utf_8(vnreg: Program, pairs: Path, tmp_path: Path, ending: str) -> None:
    name = b"gr\xf6\xdfe.npy"
    os.link(pairs.parent / "cloud_000.npy", os.fsencode(pairs.parent) + b"/" + name)
    pairs.write_bytes(b"source,target\n" + name + b",cloud_001.npy\n")
    output = tmp_path / f"results.{ending}"
    arguments = ("batch", pairs, "-o", output, *QUICK, "--json")
    assert vnreg(*arguments).json()["statuses"] == {"ok": 1}
    assert read_rows(output)[0]["source"] == "gr\\xf6\\xdfe.npy"
    assert vnreg(*arguments).json()["done_before"] == 1


# ---- going on ----


def test_what_is_done_is_not_done_again(vnreg: Program, pairs: Path, tmp_path: Path) -> None:
    for ending in FORMATS:
        output = tmp_path / f"results.{ending}"
        assert vnreg("batch", pairs, "-o", output, *QUICK).code == OK
        before = output.read_bytes()
        summary = vnreg("batch", pairs, "-o", output, *QUICK, "--json").json()
        assert (summary["done"], summary["done_before"]) == (60, 60)
        assert output.read_bytes() == before


@pytest.mark.parametrize("ending", ["csv", "jsonl"])
def test_a_file_cut_anywhere_is_completed(
    vnreg: Program, pairs: Path, tmp_path: Path, ending: str
) -> None:
    output = tmp_path / f"results.{ending}"
    arguments = ("batch", pairs, "-o", output, *QUICK)
    assert vnreg(*arguments).code == OK
    whole, content = without_ms(read_rows(output)), output.read_bytes()
    for size in np.random.default_rng(5).integers(0, len(content), 12):
        output.write_bytes(content[:size])
        summary = vnreg(*arguments, "--json").json()
        rows = read_rows(output)
        assert without_ms(rows) == whole
        header = 1 if ending == "csv" else 0
        assert summary["done_before"] == max(0, content[:size].count(b"\n") - header)


def test_parquet_is_made_again_of_the_rows_that_are_kept(
    vnreg: Program, pairs: Path, tmp_path: Path
) -> None:
    output = tmp_path / "results.parquet"
    arguments = ("batch", pairs, "-o", output, *QUICK)
    assert vnreg(*arguments).code == OK
    whole = read_rows(output)
    output.unlink()
    (tmp_path / "results.parquet.part").write_bytes(b"left by a killed run")
    assert vnreg(*arguments, "--json").json()["done_before"] == 60
    assert read_rows(output) == whole
    names = {path.name for path in tmp_path.glob("results*")}
    assert names == {"results.parquet", "results.parquet.rows.jsonl", "results.parquet.run.json"}


def test_rows_may_be_added_to_the_table(vnreg: Program, pairs: Path, tmp_path: Path) -> None:
    for ending in FORMATS:
        output = tmp_path / f"results.{ending}"
        lines = pairs.read_text().splitlines(keepends=True)
        part = pairs.parent / "part.csv"
        part.write_text("".join(lines[:31]))
        assert vnreg("batch", part, "-o", output, *QUICK).code == OK
        assert len(read_rows(output)) == 30
        part.write_text("".join(lines))
        summary = vnreg("batch", part, "-o", output, *QUICK, "--json").json()
        assert (summary["done"], summary["done_before"]) == (60, 30)
        assert [row["id"] for row in read_rows(output)] == [f"pair {i}" for i in range(60)]


def test_other_pairs_are_refused(vnreg: Program, pairs: Path, tmp_path: Path) -> None:
    output = tmp_path / "results.csv"
    assert vnreg("batch", pairs, "-o", output, *QUICK).code == OK
    before = output.read_bytes()
    lines = pairs.read_text().splitlines()
    changed = {
        "another source": [*lines[:5], "pair 4,other.npy,cloud_001.npy", *lines[6:]],
        "another id": [*lines[:5], lines[5].replace("pair 4", "pair 4b"), *lines[6:]],
        "another order": [lines[0], lines[2], lines[1], *lines[3:]],
        "fewer": lines[:-1],
    }
    for name, table in changed.items():
        pairs.write_text("\n".join(table) + "\n")
        message = vnreg("batch", pairs, "-o", output, *QUICK).error(USAGE)
        assert message.startswith(f"{output}: expected rows of these pairs in their order"), name
        assert message.endswith("name another output, or begin anew with --overwrite")
        assert output.read_bytes() == before
    assert vnreg("batch", pairs, "-o", output, *QUICK, "--overwrite").code == OK
    assert len(read_rows(output)) == 59


@pytest.mark.parametrize(
    ("other", "key"),
    [
        (("--max-points", "80", "--mode", "coarse"), "max_points 80"),
        (("--max-points", "64"), 'mode "verified"'),
        ((*QUICK, "--seed", "1"), "seed 1"),
        ((*QUICK, "--budget-ms", "2.5"), "budget_ms 2.5"),
        ((*QUICK, "--drop-non-finite"), "drop_non_finite true"),
        ((*QUICK, "--model", repository / "models/vnreg.vnr"), "model_checksum"),
    ],
)
def test_other_settings_are_refused(
    vnreg: Program, pairs: Path, tmp_path: Path, other: tuple[str, ...], key: str
) -> None:
    output = tmp_path / "results.csv"
    pairs.write_text("\n".join(pairs.read_text().splitlines()[:4]))
    assert vnreg("batch", pairs, "-o", output, *QUICK).code == OK
    message = vnreg("batch", pairs, "-o", output, *other).error(USAGE)
    assert message.startswith(f"{output}.run.json: expected {key}")


def test_a_file_of_something_else_is_kept(vnreg: Program, pairs: Path, tmp_path: Path) -> None:
    for ending in FORMATS:
        output = tmp_path / f"notes.{ending}"
        output.write_text("my notes\n")
        message = vnreg("batch", pairs, "-o", output, *QUICK).error(USAGE)
        assert "--overwrite" in message
        assert output.read_text() == "my notes\n"
        assert vnreg("batch", pairs, "-o", output, *QUICK, "--overwrite").code == OK
        assert len(read_rows(output)) == 60


def test_the_table_is_not_written_over(vnreg: Program, pairs: Path) -> None:
    before = pairs.read_bytes()
    (pairs.parent / "same.csv").symlink_to(pairs)
    for name in ("pairs.csv", "same.csv"):
        message = vnreg("batch", pairs, "-o", pairs.parent / name, "--overwrite").error(USAGE)
        assert message.endswith("expected an output beside the table, found the table")
    assert pairs.read_bytes() == before


# ---- what stops a run ----


def start_slow(program_path: Path, pairs: Path, output: Path) -> subprocess.Popen[str]:
    """A run that is in its midst: the source of the second pair is a pipe that nobody fills yet."""
    pipe = pairs.parent / "pipe.xyz"
    os.mkfifo(pipe)
    lines = pairs.read_text().splitlines()
    lines[2] = "pair 1,pipe.xyz,cloud_001.npy"
    pairs.write_text("\n".join(lines) + "\n")
    process = subprocess.Popen(
        [program_path, "batch", pairs, "-o", output, "--threads", "1", *QUICK],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for(lambda: output.is_file() and len(output.read_text().splitlines()) == 2)
    return process


def wait_for(condition: Callable[[], object]) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def opened(pipe: Path) -> TextIO:
    """The end to write to, once the run has opened the other one; to wait in open() would have no
    end where the run has gone."""
    end = time.monotonic() + 60
    while True:
        try:
            writing = os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
        except OSError as error:
            if error.errno != errno.ENXIO or time.monotonic() > end:
                raise
            time.sleep(0.005)
        else:
            os.set_blocking(writing, True)
            return os.fdopen(writing, "w")


def rows_of(cloud: Path) -> str:
    return "".join(f"{x} {y} {z}\n" for x, y, z in np.load(cloud))


@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_ends_in_good_order(
    vnreg: Program, program_path: Path, pairs: Path, tmp_path: Path, kind: signal.Signals
) -> None:
    output = tmp_path / "results.csv"
    process = start_slow(program_path, pairs, output)
    with opened(pairs.parent / "pipe.xyz") as pipe_end:
        process.send_signal(kind)
        time.sleep(0.1)
        pipe_end.write(rows_of(pairs.parent / "cloud_000.npy"))
    stdout, stderr = process.communicate(timeout=60)
    message = Run(process.returncode, stdout, stderr).error(INTERRUPTED)
    assert message.startswith("interrupted: 2 of 60 pairs are in ")
    assert [row["status"] for row in read_rows(output)] == ["ok", "ok"]
    pipe = pairs.parent / "pipe.xyz"
    pipe.unlink()
    assert vnreg("batch", pairs, "-o", output, *QUICK, "--json").json()["done_before"] == 2
    assert len(read_rows(output)) == 60


def test_two_runs_do_not_write_one_file(
    vnreg: Program, program_path: Path, pairs: Path, tmp_path: Path
) -> None:
    output = tmp_path / "results.csv"
    process = start_slow(program_path, pairs, output)
    try:
        for more in ((), ("--overwrite",)):
            message = vnreg("batch", pairs, "-o", output, *QUICK, *more).error(FAILURE)
            assert message == (
                f"{output}: expected to write it alone, found another run that writes it"
            )
        assert len(output.read_text().splitlines()) == 2
        with opened(pairs.parent / "pipe.xyz") as pipe_end:
            pipe_end.write(rows_of(pairs.parent / "cloud_000.npy"))
        process.communicate(timeout=60)
        assert process.returncode == OK
        assert len(read_rows(output)) == 60
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize("ending", FORMATS)
def test_a_full_disk(
    vnreg: Program, program_path: Path, pairs: Path, tmp_path: Path, ending: str
) -> None:
    output = tmp_path / f"results.{ending}"
    command = [program_path, "batch", pairs, "-o", output, *QUICK]
    run = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (6000, 6000)),
    )
    message = Run(run.returncode, run.stdout, run.stderr).error(FAILURE)
    assert message.endswith("expected room for the rows, found File too large")
    kept = tmp_path / "results.parquet.rows.jsonl" if ending == "parquet" else output
    assert kept.read_bytes().endswith(b"\n") and kept.stat().st_size <= 6000
    assert vnreg(*command[1:], "--json").json()["done_before"] > 0
    assert len(read_rows(output)) == 60


def test_output_that_cannot_be_written(vnreg: Program, pairs: Path, tmp_path: Path) -> None:
    output = tmp_path / "none" / "results.csv"
    message = vnreg("batch", pairs, "-o", output).error(FAILURE)
    assert message.startswith(f"{output}: expected a file that can be written to, found No such")
    (tmp_path / "full.csv").symlink_to("/dev/full")
    message = vnreg("batch", pairs, "-o", tmp_path / "full.csv").error(FAILURE)
    assert "expected a regular file" in message
    (tmp_path / "folder.csv").mkdir()
    message = vnreg("batch", pairs, "-o", tmp_path / "folder.csv").error(FAILURE)
    assert "expected a regular file" in message


@pytest.mark.parametrize(
    "arguments",
    [
        ["batch"],
        ["batch", "pairs.csv"],
        ["batch", "pairs.csv", "-o", "results.txt"],
        ["batch", "pairs.csv", "-o", "results"],
        ["batch", "pairs.csv", "-o", "results.csv", "--threads", "-1"],
        ["batch", "pairs.csv", "-o", "results.csv", "--budget-ms", "-1"],
        ["batch", "pairs.csv", "more.csv", "-o", "results.csv"],
    ],
)
def test_usage_of_batch(vnreg: Program, arguments: list[str]) -> None:
    assert vnreg(*arguments).error(USAGE).endswith("(see vnreg --help)")


def test_a_model_that_cannot_be_used_leaves_no_output(
    vnreg: Program, pairs: Path, tmp_path: Path
) -> None:
    output = tmp_path / "results.csv"
    vnreg("batch", pairs, "-o", output, "--model", pairs).error(INPUT)
    vnreg("batch", pairs, "-o", output, "--mode", "paper").error(USAGE)
    assert not output.exists()


def test_quiet_says_nothing(vnreg: Program, pairs: Path, tmp_path: Path) -> None:
    run = vnreg("batch", pairs, "-o", tmp_path / "results.csv", "--quiet", *QUICK)
    assert (run.code, run.stdout, run.stderr) == (OK, "", "")
