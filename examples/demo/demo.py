"""Aligns two real scans of one object with the command line, and shows before and after.

The program does what a user would: `vnreg align SOURCE TARGET --json -o ALIGNED`. It then turns the
source at random before a second run, because the starting pose must not matter.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from picture import draw
from scans import T_TRUE, fetch

ROOT = Path(__file__).resolve().parents[2]
LIMIT_DEG = 5.0


def align(program: Path, source: Path, target: Path, out: Path, mode: str) -> dict[str, Any]:
    """The program's JSON report; SystemExit with its message if it fails.

    It writes the moved source to `out`, and the page that shows the pair beside it.
    """
    command = [program, "align", source, target, "--json", "--mode", mode, "-o", out]
    command += ["--html", page_of(out)]
    begin = time.perf_counter()
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - begin
    if done.returncode not in (0, 4):
        sys.exit(done.stderr.strip())
    print(f"\n{' '.join(map(str, command))}\n{seconds:.2f} s, files and page included")
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def page_of(aligned: Path) -> Path:
    """Where the page goes that shows the alignment."""
    return aligned.with_suffix(".html")


def rotation_between_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Angle between the rotations of two 4x4 poses, exact near 0."""
    chord = float(np.linalg.norm(a[:3, :3] - b[:3, :3]))  # 2 sqrt(2) sin(angle / 2)
    return math.degrees(2 * math.asin(min(1.0, chord / math.sqrt(8))))


def print_report(title: str, report: dict[str, Any]) -> None:
    print(f"{title}: {report['status']}, mode {report['mode']}, model {report['model']}")
    print("T_target_source")
    for row in report["T_target_source"]:
        print("  " + "  ".join(f"{value:10.6f}" for value in row))
    print(f"overlap {report['overlap']:.2f}, residual {report['rmse']:.4f} (units of the scans)")
    stages = ", ".join(f"{k} {v:.1f}" for k, v in report["ms"].items() if k != "total" and v > 0)
    print(f"{report['ms']['total']:.0f} ms: {stages}")


def turned_copy(source: Path, path: Path) -> NDArray[np.float64]:
    """Writes the source in another pose, and returns that pose T_turned_source."""
    turn = trimesh.transformations.random_rotation_matrix(np.array([0.3, 0.6, 0.9]))
    turn[:3, 3] = [0.5, -0.3, 0.2]
    cloud = trimesh.load(source)
    cloud.apply_transform(turn)
    cloud.export(path)
    return np.asarray(turn, dtype=np.float64)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=Path, default=ROOT / "build/release/vnreg")
    parser.add_argument("--scans", type=Path, default=ROOT / "data/scans", help="cache folder")
    parser.add_argument("--out", type=Path, default=ROOT / "build/demo", help="folder of pictures")
    parser.add_argument("--mode", default="verified")
    parser.add_argument("--open", action="store_true", help="show the last page, on a desktop")
    parser.add_argument("--check", action="store_true", help="fail if the pose is not the true one")
    arguments = parser.parse_args()

    source, target = fetch(arguments.scans)
    arguments.out.mkdir(parents=True, exist_ok=True)
    turned = arguments.out / "turned.ply"
    T_turned_source = turned_copy(source, turned)
    errors = []
    for title, start, T_start_source in (
        ("two scans as they are", source, np.eye(4)),
        ("the first one turned and moved away", turned, T_turned_source),
    ):
        aligned = arguments.out / f"aligned_{start.stem}.ply"
        report = align(arguments.program, start, target, aligned, arguments.mode)
        if report["T_target_source"] is None:
            sys.exit(f"no pose: {report['status']}")
        print_report(title, report)
        errors.append(
            rotation_between_deg(np.array(report["T_target_source"]) @ T_start_source, T_TRUE)
        )
        print(f"rotation error {errors[-1]:.2f} degrees against the known pose")
        clouds = [np.asarray(trimesh.load(path).vertices) for path in (start, target, aligned)]
        picture = arguments.out / f"{start.stem}.png"
        caption = f"{report['ms']['total']:.0f} ms, overlap {report['overlap']:.0%}"
        draw(*clouds, f"vnreg align, mode {report['mode']}: {caption}", picture)
        print(f"picture: {picture}")
        print(f"in 3D, for any browser: {page_of(aligned)}")
    if arguments.open and ("DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ):
        webbrowser.open(page_of(aligned).resolve().as_uri())
    if arguments.check and max(errors) > LIMIT_DEG:
        sys.exit(f"rotation error above {LIMIT_DEG} degrees: {max(errors):.2f}")


if __name__ == "__main__":
    main()
