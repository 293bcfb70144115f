"""The training loop, the same for both stages."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from torch.optim.lr_scheduler import OneCycleLR
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn
from torch.utils.tensorboard import SummaryWriter
from tqdm import tqdm

from vnreg_train.data.resample import TrainingSampler
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.networks.registration import RegistrationNetwork
from vnreg_train.training.batches import BatchSequence
from vnreg_train.training.checkpoint import (
    restore_training_state,
    save_checkpoint,
    training_state,
)
from vnreg_train.training.config import StageConfig, TrainingConfig
from vnreg_train.training.initial import scale_initial_weights
from vnreg_train.training.stages import CoarseStage, FineStage, JointStage

Stage = CoarseStage | FineStage | JointStage
STAGES: dict[str, type[Stage]] = {"coarse": CoarseStage, "fine": FineStage, "joint": JointStage}
BEFORE = {"fine": "coarse", "joint": "fine"}  # whose average a stage starts from
LOG_EVERY = 50  # steps


class StageTrainer:
    """One stage: network, average, optimiser and schedule, new or from a checkpoint."""

    def __init__(
        self,
        config: TrainingConfig,
        stage: str,
        shapes: ShapeSet,
        run_folder: Path,
        initial: Path | None = None,
    ) -> None:
        """`initial`: a checkpoint whose averaged weights a new run starts from."""
        if stage not in STAGES:
            raise ValueError(f"stage: expected one of {tuple(STAGES)}, got {stage!r}")
        torch.set_num_threads(config.threads)
        torch.manual_seed(config.seed)
        self.config, self.stage, self.run_folder = config, stage, run_folder
        self.settings: StageConfig = getattr(config, stage)
        self.network = RegistrationNetwork(config.network)
        self.module: Stage = STAGES[stage](self.network, self.settings, config.compile)
        self.average = AveragedModel(
            self.network,
            multi_avg_fn=get_ema_multi_avg_fn(self.settings.ema_decay),
            use_buffers=True,
        )
        self.optimizer = torch.optim.AdamW(
            self.module.trainable(),
            lr=self.settings.learning_rate,
            weight_decay=self.settings.weight_decay,
        )
        self.schedule = OneCycleLR(
            self.optimizer,
            max_lr=self.settings.learning_rate,
            total_steps=self.settings.steps,
            pct_start=self.settings.warmup,
            cycle_momentum=False,
        )
        self.batches = BatchSequence(
            TrainingSampler(
                shapes,
                points=config.data.points,
                batch=self.settings.batch,
                settings_mix=config.data.settings,
                seed=config.seed + list(STAGES).index(stage),
                queries=config.data.queries,
                augment=config.data.anisotropic,
            ),
            neighbours=config.data.neighbours or config.network.neighbours,
            rms_radius=config.network.input_rms_radius,
            turn=stage != "coarse",
            steps=self.settings.steps,
            apart=not config.network.equivariant,
        )
        self.step = 0
        self.skipped = 0
        self._start(initial)

    @property
    def checkpoint(self) -> Path:
        return self.run_folder / f"{self.stage}.pt"

    def _start(self, initial: Path | None) -> None:
        """Resumes this stage, or starts from `initial`, or the fine one from the coarse one."""
        if self.checkpoint.exists():
            state = torch.load(self.checkpoint, weights_only=True)
            self.step = restore_training_state(
                state, self.network, self.average, self.optimizer, self.schedule
            )
        elif initial is not None or self.stage in BEFORE:
            weights = initial or self.run_folder / f"{BEFORE[self.stage]}.pt"
            if not weights.exists():
                raise FileNotFoundError(f"{weights}: train stage {weights.stem} first")
            self.network.load_state_dict(torch.load(weights, weights_only=True)["ema"])
            self.average.module.load_state_dict(self.network.state_dict())
        elif self.settings.scaled_start:
            scale_initial_weights(self.network.extractor, self.batches[0].edges)
            self.average.module.load_state_dict(self.network.state_dict())

    def save(self) -> None:
        save_checkpoint(
            self.checkpoint,
            **training_state(
                self.stage,
                self.step,
                self.network,
                self.average,
                self.optimizer,
                self.schedule,
                asdict(self.config),
            ),
        )

    def train_step(self, batch: Any) -> dict[str, float]:
        """One optimiser step. A step whose gradient is not finite is skipped and counted."""
        self.module.train()
        self._freeze_statistics()
        loss, terms = self.module(batch)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        norm = torch.nn.utils.clip_grad_norm_(self.module.trainable(), self.settings.clip_norm)
        if torch.isfinite(norm):
            self.optimizer.step()
            self.average.update_parameters(self.network)
        else:
            self.skipped += 1
        self.schedule.step()
        self.step += 1
        figures = {name: float(value) for name, value in terms.items()}
        return figures | {"loss": float(loss), "gradient_norm": float(norm)}

    def _freeze_statistics(self) -> None:
        """The frozen parts of the second stage keep their batch-norm statistics too."""
        if self.stage == "fine":
            self.network.extractor.global_module.eval()
            self.network.decoder.eval()

    def run(self, max_minutes: float = float("inf"), progress: bool = True) -> None:
        """Trains until the last step or for so many minutes; saves at intervals and at the end."""
        writer = SummaryWriter(str(self.run_folder / "tensorboard" / self.stage))
        started = last_saved = time.monotonic()
        window: dict[str, float] = {}
        first = self.step
        bar = tqdm(
            total=self.settings.steps,
            initial=self.step,
            desc=self.stage,
            disable=not progress,
            mininterval=10.0,
        )
        for batch in self.batches.loader(self.step):
            for name, value in self.train_step(batch).items():
                window[name] = window.get(name, 0.0) + value / LOG_EVERY
            bar.update()
            now = time.monotonic()
            if self.step % LOG_EVERY == 0:
                pairs = (self.step - first) * self.settings.batch / (now - started)
                self._log(writer, window | {"pairs_per_second": pairs, "skipped": self.skipped})
                bar.set_postfix({k: f"{v:.3g}" for k, v in window.items() if k != "gradient_norm"})
                window = {}
            if now - last_saved > 60 * self.config.checkpoint_minutes:
                self.save()
                last_saved = now
            if now - started > 60 * max_minutes:
                break
        bar.close()
        writer.close()
        self.save()

    def _log(self, writer: SummaryWriter, figures: dict[str, float]) -> None:
        for name, value in figures.items():
            writer.add_scalar(name, value, self.step)
        writer.add_scalar("learning_rate", self.schedule.get_last_lr()[0], self.step)
