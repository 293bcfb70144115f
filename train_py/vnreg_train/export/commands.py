"""The commands of `vnreg-train` about model files: export, import-authors, golden, inspect."""

from __future__ import annotations

import argparse
from pathlib import Path

from vnreg_train.command_help import Lesson, Subcommands, add_command

EXPORT = Lesson(
    summary="write a checkpoint's averaged weights as a .vnr file",
    reads="A checkpoint of `vnreg-train train`, of either network.",
    writes="OUT, which every build of the engine reads. It is read back and compared before it "
    "appears under its name; equal weights give equal bytes. It has no judge and no calibration.",
    takes="Seconds.",
    example="export runs/mine/vnreg.pt mine.vnr --name mine --provenance licence=CC0-1.0",
)
AUTHORS = Lesson(
    summary="write a checkpoint of the paper's authors as a .vnr file",
    reads="A .pth file that their train.py saved (github.com/linchengweiii/CFReg).",
    writes="OUT, for mode paper (mode coarse alone, where the checkpoint is of that stage).",
    takes="Seconds.",
    example="import-authors theirs.pth --out authors.vnr",
)
GOLDEN = Lesson(
    summary="write every activation of one pair, for `vnreg selftest`",
    reads="A checkpoint, the model file exported from it, and one validation shape.",
    writes="OUT: two clouds and what torch computes of them, stage by stage; the engine has to "
    "compute the same.",
    takes="Seconds.",
    example="golden runs/mine/vnreg.pt mine.vnr mine.golden.vnr",
)
INSPECT = Lesson(
    summary="tell what a model file, a golden file or a checkpoint holds",
    reads="A .vnr file, and its card (NAME.md) and golden file (NAME.golden.vnr) where they lie "
    "beside it; or a .pt file of `vnreg-train train`.",
    writes="Nothing. Prints the architecture, every tensor with its shape, norm and largest "
    "number, the judge, the calibration, the card and whether the golden file is of this model; of "
    "a checkpoint its stage, step and schedule, and how far its averaged weights are from the "
    "last.",
    takes="Seconds.",
    example="inspect models/vnreg.vnr",
)


def add_model_commands(commands: Subcommands) -> None:
    _add_export(add_command(commands, "export", EXPORT))
    _add_import_authors(add_command(commands, "import-authors", AUTHORS))
    _add_golden(add_command(commands, "golden", GOLDEN))
    _add_inspect(add_command(commands, "inspect", INSPECT))


def _add_export(command: argparse.ArgumentParser) -> None:
    command.add_argument("checkpoint", help="a .pt file of `vnreg-train train`")
    command.add_argument("out", help="the .vnr file")
    command.add_argument("--name", help="the model's name (default: the configuration's)")
    command.add_argument(
        "--points", type=int, default=1024, help="what the engine subsamples clouds to"
    )
    command.add_argument(
        "--provenance", nargs="*", default=[], metavar="KEY=TEXT", help="notes kept in the file"
    )
    command.add_argument(
        "--fine-iterations", type=int, help="the paper's network only, instead of the configured"
    )
    command.add_argument("--keep-divisor", type=int, help="likewise: match a cloud's N-th part")
    command.set_defaults(run_command=export_model_file)


def _add_import_authors(command: argparse.ArgumentParser) -> None:
    command.add_argument("checkpoint", help="a .pth file that their train.py saved")
    command.add_argument("--out", required=True, help="the .vnr file")
    command.add_argument("--name", default="authors", help="the model's name")
    command.set_defaults(run_command=import_authors_checkpoint)


def _add_golden(command: argparse.ArgumentParser) -> None:
    command.add_argument("checkpoint", help="a .pt file of `vnreg-train train`")
    command.add_argument("model", help="the .vnr file exported from the checkpoint")
    command.add_argument("out", help="the golden file")
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument("--shape", type=int, default=0, help="index in the validation split")
    command.set_defaults(run_command=write_golden)


def _add_inspect(command: argparse.ArgumentParser) -> None:
    command.add_argument("file", help="a .vnr or a .pt file")
    command.set_defaults(run_command=inspect_file)


def export_model_file(arguments: argparse.Namespace) -> None:
    from vnreg_train.export.checkpoint import checkpoint_arch, export_checkpoint

    checkpoint = Path(arguments.checkpoint)
    notes = dict(pair.split("=", 1) for pair in arguments.provenance)
    asked = {"iterations": arguments.fine_iterations, "keep_divisor": arguments.keep_divisor}
    settings = {f"fine.{key}": value for key, value in asked.items() if value is not None}
    if settings and checkpoint_arch(checkpoint) != "paper":
        raise SystemExit("vnreg-train export: this network has no fine register")
    export_checkpoint(
        checkpoint,
        Path(arguments.out),
        arguments.name,
        points=arguments.points,
        extra={f"provenance.{key}": value for key, value in notes.items()} | settings,
    )


def import_authors_checkpoint(arguments: argparse.Namespace) -> None:
    from vnreg_train.export.import_authors import AuthorsCheckpointError, import_authors
    from vnreg_train.export.model import export_model

    try:
        imported = import_authors(Path(arguments.checkpoint))
    except (AuthorsCheckpointError, OSError) as error:
        raise SystemExit(f"vnreg-train import-authors: {error}") from error
    source = {"provenance.source": "a checkpoint of github.com/linchengweiii/CFReg"}
    export_model(imported.network, Path(arguments.out), arguments.name, extra=dict(source))
    if not imported.has_fine:
        print("the checkpoint holds the coarse stage alone: the model has mode coarse only")


def write_golden(arguments: argparse.Namespace) -> None:
    from vnreg_train.data.protocol import make_pair
    from vnreg_train.data.shapes import load_shapes
    from vnreg_train.export.checkpoint import golden_of_checkpoint

    shapes = load_shapes(Path(arguments.data), "validation")
    pair = make_pair(shapes, arguments.shape, "independent", 180)
    # Few points, and not equally many: the file holds every activation.
    source, target = pair.source[:128].astype("float64"), pair.target[:120].astype("float64")
    checkpoint, model, out = map(Path, (arguments.checkpoint, arguments.model, arguments.out))
    golden_of_checkpoint(checkpoint, model, out, source, target)


def inspect_file(arguments: argparse.Namespace) -> None:
    from vnreg_train.export.inspect import InspectError, inspection

    try:
        print(inspection(Path(arguments.file)))
    except (InspectError, OSError) as error:
        raise SystemExit(f"vnreg-train inspect: {error}") from error
