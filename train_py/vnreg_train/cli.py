"""`vnreg-train`: build the data, train networks and the judge, export, evaluate."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from vnreg_train.training.config import RunConfig, TrainingConfig, config_arch, load_config

if TYPE_CHECKING:
    from vnreg_train.data.shapes import ShapeSet


def build_data(arguments: argparse.Namespace) -> None:
    from vnreg_train.data.build import build_furniture

    build_furniture(
        Path(arguments.out),
        Path(arguments.cache),
        splits=tuple(arguments.splits),
        occupancy=not arguments.no_occupancy,
        jobs=arguments.jobs,
    )


def _with_steps(config: TrainingConfig, stage: str, steps: int | None) -> TrainingConfig:
    from dataclasses import replace

    if steps is None:
        return config
    return replace(config, **{stage: replace(getattr(config, stage), steps=steps)})


def train(arguments: argparse.Namespace) -> None:
    if config_arch(arguments.config) == "vnreg":
        train_descriptor(arguments)
    elif arguments.stage is None:
        raise SystemExit(
            "vnreg-train train: the paper's network needs --stage coarse, fine or joint"
        )
    else:
        train_stage(arguments)


def train_descriptor(arguments: argparse.Namespace) -> None:
    from dataclasses import replace

    from vnreg_train.data.shapes import load_shapes
    from vnreg_train.training.descriptor_config import load_descriptor_config
    from vnreg_train.training.descriptor_train import DescriptorTrainer

    config = load_descriptor_config(arguments.config)
    if arguments.steps:
        config = replace(config, optimisation=replace(config.optimisation, steps=arguments.steps))
    if arguments.threads:
        config = replace(config, threads=arguments.threads)
    shapes = load_shapes(Path(arguments.data or config.data.folder), "train", queries=0)
    run = Path(arguments.run or Path("runs") / config.name)
    validation = validation_shapes(arguments, config, config.data.folder)
    trainer = DescriptorTrainer(config, shapes, run, validation)
    trainer.run(max_minutes=arguments.minutes, progress=not arguments.quiet)


def train_stage(arguments: argparse.Namespace) -> None:
    from dataclasses import replace

    from vnreg_train.data.shapes import load_shapes
    from vnreg_train.training.train import StageTrainer

    config = _with_steps(load_config(arguments.config), arguments.stage, arguments.steps)
    if arguments.threads:
        config = replace(config, threads=arguments.threads)
    shapes = load_shapes(Path(arguments.data or config.data.folder), "train")
    run = Path(arguments.run or Path("runs") / config.name)
    initial = Path(arguments.initial) if arguments.initial else None
    validation = validation_shapes(arguments, config, config.data.folder)
    trainer = StageTrainer(config, arguments.stage, shapes, run, initial, validation)
    trainer.run(max_minutes=arguments.minutes, progress=not arguments.quiet)


def validation_shapes(
    arguments: argparse.Namespace, config: RunConfig, folder: str
) -> ShapeSet | None:
    """Those to validate on; None where the configuration wants none, or the data have none."""
    from vnreg_train.data.shapes import ShapesError, load_shapes
    from vnreg_train.evaluate.pairs import shape_indices

    if config.validation_steps == 0:
        return None
    try:
        shapes = load_shapes(Path(arguments.data or folder), "validation", queries=0)
    except ShapesError as error:
        print(f"training without validation: {error}")
        return None
    return shapes.subset(shape_indices(len(shapes), config.validation_shapes))


def train_judge(arguments: argparse.Namespace) -> None:
    import os

    os.environ["OMP_NUM_THREADS"] = "1"
    import torch

    from vnreg_train.evaluate.symmetry import read_symmetries
    from vnreg_train.training import judge_train
    from vnreg_train.training.judge_samples import collect_samples

    torch.set_num_threads(1)
    model, out = Path(arguments.model), Path(arguments.out)
    samples = collect_samples(
        model,
        "train",
        judge_train.ROWS,
        arguments.seeds,
        read_symmetries(),
        Path(arguments.data),
        different=arguments.different,
    )
    settings = judge_train.JudgeTraining(steps=arguments.steps)
    judge_train.write_judge(model, out, judge_train.train_judge(samples, settings))


def export(arguments: argparse.Namespace) -> None:
    from vnreg_train.export.checkpoint import export_checkpoint

    extra = dict(pair.split("=", 1) for pair in arguments.provenance)
    export_checkpoint(
        Path(arguments.checkpoint),
        Path(arguments.out),
        arguments.name,
        points=arguments.points,
        extra={f"provenance.{key}": value for key, value in extra.items()},
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


def golden(arguments: argparse.Namespace) -> None:
    from vnreg_train.data.protocol import make_pair
    from vnreg_train.data.shapes import load_shapes
    from vnreg_train.export.checkpoint import golden_of_checkpoint

    shapes = load_shapes(Path(arguments.data), "validation")
    pair = make_pair(shapes, arguments.shape, "independent", 180)
    # Few points, and not equally many: the file holds every activation.
    source, target = pair.source[:128].astype("float64"), pair.target[:120].astype("float64")
    checkpoint, model, out = map(Path, (arguments.checkpoint, arguments.model, arguments.out))
    golden_of_checkpoint(checkpoint, model, out, source, target)


def parser() -> argparse.ArgumentParser:
    root = argparse.ArgumentParser(prog="vnreg-train", description=__doc__)
    commands = root.add_subparsers(required=True, metavar="COMMAND")

    data = commands.add_parser("build-data", help="fetch the furniture models and sample them")
    data.add_argument("--out", default="data/furniture", help="folder of the HDF5 files")
    data.add_argument("--cache", default="data/furniture/cache", help="where packages are kept")
    data.add_argument("--splits", nargs="+", default=["train", "validation", "test"])
    data.add_argument("--no-occupancy", action="store_true", help="skip the decoder's labels")
    data.add_argument("--jobs", type=int, default=2)
    data.set_defaults(run_command=build_data)

    fit = commands.add_parser("train", help="train a network (or one stage); resumes")
    fit.add_argument("config", help="a TOML file, or the name of a shipped one: vnreg, small")
    fit.add_argument("--stage", choices=("coarse", "fine", "joint"), help="paper's network only")
    fit.add_argument("--run", help="folder of checkpoints and curves (default runs/NAME)")
    fit.add_argument("--initial", help="a checkpoint whose weights a new run starts from")
    fit.add_argument("--data", help="folder of the shapes (default: as configured)")
    fit.add_argument("--steps", type=int, help="length of the schedule, instead of the configured")
    fit.add_argument("--threads", type=int, help="torch threads, instead of the configured")
    fit.add_argument("--minutes", type=float, default=float("inf"), help="stop after so long")
    fit.add_argument("--quiet", action="store_true", help="no progress bar")
    fit.set_defaults(run_command=train)

    judge = commands.add_parser("train-judge", help="train the judge of a .vnr file's poses")
    judge.add_argument("model", help="a .vnr file of architecture vnreg")
    judge.add_argument("--out", required=True, help="the model with its judge (may be itself)")
    judge.add_argument("--data", default="data/furniture", help="folder of the shapes")
    judge.add_argument("--seeds", nargs="+", type=int, default=[100], help="of the pairs")
    judge.add_argument(
        "--different", type=int, default=1500, help="pairs of different objects, all wrong"
    )
    judge.add_argument("--steps", type=int, default=10000)
    judge.set_defaults(run_command=train_judge)

    out = commands.add_parser("export", help="write a checkpoint's averaged weights as a .vnr file")
    out.add_argument("checkpoint")
    out.add_argument("out")
    out.add_argument("--name", help="the model's name (default: the configuration's)")
    out.add_argument("--points", type=int, default=1024, help="default subsampling of the engine")
    out.add_argument("--provenance", nargs="*", default=[], metavar="KEY=TEXT")
    out.set_defaults(run_command=export)

    authors = commands.add_parser(
        "import-authors", help="write a checkpoint of the paper's authors as a .vnr file"
    )
    authors.add_argument("checkpoint", help="a .pth file that their train.py saved")
    authors.add_argument("--out", required=True, help="the .vnr file")
    authors.add_argument("--name", default="authors", help="the model's name")
    authors.set_defaults(run_command=import_authors_checkpoint)

    gold = commands.add_parser("golden", help="write every activation of one pair, for selftest")
    gold.add_argument("checkpoint")
    gold.add_argument("model", help="the .vnr file exported from the checkpoint")
    gold.add_argument("out")
    gold.add_argument("--data", default="data/furniture")
    gold.add_argument("--shape", type=int, default=0, help="index in the validation split")
    gold.set_defaults(run_command=golden)

    from vnreg_train.evaluate.arguments import add_evaluation_commands

    add_evaluation_commands(commands)
    return root


def main() -> None:
    arguments = parser().parse_args()
    arguments.run_command(arguments)


if __name__ == "__main__":
    main()
