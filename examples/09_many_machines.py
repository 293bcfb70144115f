"""A table of pairs on the cores of this machine, killed and resumed if you like, into parquet.

Give it the address of a Dask scheduler, and the same pairs run on a cluster: docs/batch.md.
Needs vnreg[batch]. Writes the folder 09_results into the current one.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pyarrow.dataset

import vnreg

DATA = Path(__file__).resolve().parent / "data"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--address", help="of a Dask scheduler, such as tcp://host:8786")
    parser.add_argument("--pairs", type=int, default=40)
    arguments = parser.parse_args()

    # A table is read as the work goes on: it may be longer than memory. Its last row is a mistake.
    scans = [str(DATA / "mug_1.xyz"), str(DATA / "mug_2.xyz")]
    rows = [f"{scans[i % 2]},{scans[(i + 1) % 2]}" for i in range(arguments.pairs)]
    rows.append(f"{DATA / 'mug_3.xyz'},{scans[0]}")
    pairs = Path("09_pairs.csv")
    pairs.write_text("\n".join(["source,target", *rows]))

    # Kill it with Ctrl-C and start it again: it goes on where it was.
    report = vnreg.batch(
        pairs,
        "09_results",
        address=arguments.address,
        part_rows=10,
        progress=lambda so_far: print(f"{so_far.rows} rows, {so_far.seconds:.1f} s"),
    )
    print(f"done now: {report.statuses}; parts done before: {report.resumed_parts}")

    # Rows of all parts, only the columns that are asked for.
    results = pyarrow.dataset.dataset("09_results", format="parquet")
    sure = results.to_table(["row"], filter=pyarrow.dataset.field("confidence") > 0.9)
    print(f"sure of {len(sure)} of {results.count_rows()} pairs")
    for row in results.to_table(filter=pyarrow.dataset.field("error").is_valid()).to_pylist():
        print(f"pair {row['id']}: {row['error']}")


if __name__ == "__main__":
    main()
