"""The commands of `vnreg-train` that make data and train: build-data, train, train-judge."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from vnreg_train.command_help import Lesson, Subcommands, add_command
from vnreg_train.training.config import RunConfig, TrainingConfig, config_arch, load_config

if TYPE_CHECKING:
    from vnreg_train.data.shapes import ShapeSet

BUILD_DATA = Lesson(
    summary="fetch the furniture models and sample them",
    reads="The Debian package sweethome3d-furniture 1.8-1, fetched into --cache (120 MB) unless it "
    "is there; never installed. Which model belongs to which split is a committed list.",
    writes="OUT/train.h5 (575 shapes), validation.h5 (82), test.h5 (163): 8,192 points on each "
    "surface and, for the paper's decoder, points labelled inside or outside.",
    takes="Some 20 minutes for all on two cores, nearly all of it for the labels; one split "
    "without labels (--no-occupancy) 10 to 60 seconds.",
    example="build-data --splits train validation --no-occupancy",
)
TRAIN = Lesson(
    summary="train a network (or one stage of the paper's); resumes",
    reads="A configuration (every number of the network, the data and the schedule), the training "
    "shapes, and the validation shapes for the curves.",
    writes="RUN/NAME.pt, the checkpoint from which a second call goes on, every few minutes and at "
    "the end; RUN/tensorboard, curves for `tensorboard --logdir RUN`.",
    takes="Configuration vnreg 92 minutes on one core of an AMD EPYC (Zen 4), small 85 for both "
    "stages; the memory of the shapes, 1 to 2 GB.",
    example="train vnreg --run runs/mine --minutes 30",
)
TRAIN_JUDGE = Lesson(
    summary="train the judge, which decides between the last poses of a .vnr file's network",
    reads="A model file; pairs of the training shapes, which the engine aligns to see what poses "
    "it proposes; the symmetries of the shapes (data/symmetries).",
    writes="OUT: the same model with the new judge and without calibration (calibrate it next).",
    takes="17 minutes on one core with the defaults: 9 for the poses of 21,000 pairs (9 GB of "
    "memory), 8 for 10,000 steps.",
    example="train-judge mine.vnr --out mine.vnr --seeds 100",
)


def add_training_commands(commands: Subcommands) -> None:
    _add_build_data(add_command(commands, "build-data", BUILD_DATA))
    _add_train(add_command(commands, "train", TRAIN))
    _add_train_judge(add_command(commands, "train-judge", TRAIN_JUDGE))


def _add_build_data(command: argparse.ArgumentParser) -> None:
    splits = ("train", "validation", "test")
    command.add_argument("--out", default="data/furniture", help="folder of the HDF5 files")
    command.add_argument("--cache", default="data/furniture/cache", help="where packages are kept")
    command.add_argument(
        "--splits", nargs="+", default=list(splits), choices=splits, help="only these"
    )
    command.add_argument("--no-occupancy", action="store_true", help="skip the decoder's labels")
    command.add_argument("--jobs", type=int, default=2, help="processes")
    command.set_defaults(run_command=build_data)


def _add_train(command: argparse.ArgumentParser) -> None:
    command.add_argument("config", help="a TOML file, or the name of a shipped one: vnreg, small")
    command.add_argument(
        "--stage",
        choices=("coarse", "fine", "joint"),
        help="of the paper's network",
    )
    command.add_argument("--run", help="folder of checkpoints and curves (default: runs/NAME)")
    command.add_argument("--initial", help="a checkpoint whose weights a new run starts from")
    command.add_argument("--data", help="folder of the shapes (default: as configured)")
    command.add_argument("--steps", type=int, help="in the schedule (default: as configured)")
    command.add_argument("--threads", type=int, help="of torch (default: as configured)")
    command.add_argument("--device", help="of torch, for the paper's network: cpu, cuda, cuda:1")
    command.add_argument("--minutes", type=float, default=float("inf"), help="stop after so long")
    command.add_argument("--quiet", action="store_true", help="no progress bar")
    command.set_defaults(run_command=train_network)


def _add_train_judge(command: argparse.ArgumentParser) -> None:
    command.add_argument("model", help="a .vnr file of architecture vnreg")
    command.add_argument("--out", required=True, help="the model with its judge (may be itself)")
    command.add_argument("--data", default="data/furniture", help="folder of the shapes")
    command.add_argument("--seeds", nargs="+", type=int, default=[100, 101], help="of the pairs")
    command.add_argument(
        "--different", type=int, default=4000, help="pairs of different objects, all wrong"
    )
    command.add_argument("--steps", type=int, default=10000, help="of the optimiser")
    command.set_defaults(run_command=train_judge_of_model)


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


def train_network(arguments: argparse.Namespace) -> None:
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
    if arguments.device:
        config = replace(config, device=arguments.device)
    folder = Path(arguments.data or config.data.folder)
    shapes = load_shapes(folder, "train", points=config.data.surface_points or None)
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


def train_judge_of_model(arguments: argparse.Namespace) -> None:
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
