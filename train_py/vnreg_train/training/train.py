"""The training of the paper's network, stage by stage."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from pathlib import Path

import torch

from vnreg_train.data.resample import TrainingSampler
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.batches import Batch, BatchSequence
from vnreg_train.training.checkpoint import read_checkpoint
from vnreg_train.training.config import StageConfig, TrainingConfig
from vnreg_train.training.flops import pair_gflop
from vnreg_train.training.initial import scale_initial_weights
from vnreg_train.training.loop import Losses, Trainer, begin_run
from vnreg_train.training.stage_validation import validate_stage
from vnreg_train.training.stages import CoarseStage, FineStage, JointStage

Stage = CoarseStage | FineStage | JointStage
STAGES: dict[str, type[Stage]] = {"coarse": CoarseStage, "fine": FineStage, "joint": JointStage}
BEFORE = {"fine": "coarse", "joint": "fine"}  # whose average a stage starts from


class StageTrainer(Trainer[RegistrationNetwork, Batch]):
    """A run of one stage.

    initial: a checkpoint whose averaged weights a new run starts from. validation: shapes to
    measure the averaged weights on.
    """

    def __init__(
        self,
        config: TrainingConfig,
        stage: str,
        shapes: ShapeSet,
        run_folder: Path,
        initial: Path | None = None,
        validation: ShapeSet | None = None,
    ) -> None:
        if stage not in STAGES:
            raise ValueError(f"stage: expected one of {tuple(STAGES)}, got {stage!r}")
        begin_run(config)
        self.config, self.stage, self.validation = config, stage, validation
        self._initial = initial
        settings: StageConfig = getattr(config, stage)
        self.device = torch.device(config.device)
        network = RegistrationNetwork(config.network).to(self.device)
        self.module: Stage = STAGES[stage](network, settings, config.compile)
        self.batches = self._sequence(shapes, settings, config.seed + list(STAGES).index(stage))
        super().__init__(stage, network, self.module.trainable(), config, settings, run_folder)

    def _sequence(self, shapes: ShapeSet, settings: StageConfig, seed: int) -> BatchSequence:
        data, network = self.config.data, self.config.network
        sampler = TrainingSampler(
            shapes,
            points=data.points,
            batch=settings.batch,
            settings_mix=data.settings,
            seed=seed,
            queries=data.queries,
            augment=data.anisotropic,
            diagonal_crops=data.diagonal_crops,
        )
        return BatchSequence(
            sampler,
            neighbours=data.neighbours or network.neighbours,
            rms_radius=network.input_rms_radius,
            turn=self.stage != "coarse",
            steps=settings.steps,
            apart=not network.equivariant,
            move=not settings.centred_occupancy,
        )

    def _choose_first_weights(self) -> None:
        """Those of `initial`, or the average of the stage before, or random ones."""
        if self._initial is not None or self.stage in BEFORE:
            weights = self._initial or self.run_folder / f"{BEFORE[self.stage]}.pt"
            if not weights.exists():
                raise FileNotFoundError(f"{weights}: train stage {weights.stem} first")
            self.network.load_state_dict(read_checkpoint(weights)["ema"])
            self.average.module.load_state_dict(self.network.state_dict())
        elif self.module.config.scaled_start:
            scale_initial_weights(self.network.extractor, self.batches[0].edges.to(self.device))
            self.average.module.load_state_dict(self.network.state_dict())

    def _batches(self) -> Iterable[Batch]:
        return self.batches.loader(self.step)

    def _losses(self, batch: Batch) -> Losses:
        self.module.train()
        if self.stage == "fine":  # what is frozen keeps its batch-norm statistics too
            self.network.extractor.global_module.eval()
            self.network.decoder.eval()
        return self.module(batch.to(self.device))

    @cached_property
    def _pair_gflop(self) -> float:
        return pair_gflop(self.config, self.stage)

    def _speed(self, pairs_per_second: float) -> dict[str, float]:
        """Also GFLOP/s, of the matrix products alone."""
        gflops = self._pair_gflop * pairs_per_second
        return super()._speed(pairs_per_second) | {"gflop_per_second": gflops}

    def _validate(self) -> dict[str, float]:
        if self.validation is None:
            return {}
        fine = self.stage != "coarse"
        return validate_stage(self.averaged(), self.validation, self.config, fine)
