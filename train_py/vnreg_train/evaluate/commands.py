"""The bodies of `vnreg-train evaluate` and `vnreg-train calibrate`."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from vnreg_train.data.shapes import load_shapes


def evaluate_main(arguments: argparse.Namespace) -> None:
    """Measures the recall table; prints it, and writes --json and --report."""
    from vnreg_train.evaluate.recall import evaluate_model, write_json
    from vnreg_train.evaluate.report import markdown, write_report

    shapes = load_shapes(Path(arguments.data), arguments.split, queries=0)
    table = evaluate_model(
        Path(arguments.model),
        shapes,
        arguments.split,
        settings=arguments.settings,
        angles_deg=arguments.angles,
        protocol=arguments.protocol,
        seed=arguments.seed,
        mode=arguments.mode,
        threads=arguments.threads,
        limit=arguments.limit,
    )
    print(markdown(table), end="")
    write_json(table, Path(arguments.json))
    if arguments.report:
        write_report(table, Path(arguments.report))


def calibrate_main(arguments: argparse.Namespace) -> None:
    """Fits the confidence; prints it as JSON, and writes the calibrated model to --out."""
    from vnreg_train.evaluate.calibrate import calibrate_model, write_calibrated

    shapes = load_shapes(Path(arguments.data), arguments.split, queries=0)
    calibration = calibrate_model(
        Path(arguments.model), shapes, threads=arguments.threads, limit=arguments.limit
    )
    print(json.dumps(asdict(calibration), indent=1))
    if arguments.out:
        write_calibrated(Path(arguments.model), Path(arguments.out), calibration)
