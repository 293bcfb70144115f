"""`vnreg-train`: build the data, train networks and the judge, export, evaluate.

The way from nothing to a model of your own: build-data, train, export, train-judge, calibrate,
golden, inspect. The way to figures: evaluate, report, gallery; to those of docs/paper.md: the
paper-* commands. Every command has its --help.
"""

from __future__ import annotations

import argparse

from vnreg_train.evaluate.arguments import add_evaluation_commands
from vnreg_train.export.commands import add_model_commands
from vnreg_train.paper.arguments import add_paper_commands
from vnreg_train.training.commands import add_training_commands


def parser() -> argparse.ArgumentParser:
    """The commands. What they need is imported when they run."""
    root = argparse.ArgumentParser(
        prog="vnreg-train",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = root.add_subparsers(required=True, metavar="COMMAND")
    add_training_commands(commands)
    add_model_commands(commands)
    add_evaluation_commands(commands)
    add_paper_commands(commands)
    return root


def main() -> None:
    arguments = parser().parse_args()
    arguments.run_command(arguments)


if __name__ == "__main__":
    main()
