"""The training loop, the same for every network: steps, checkpoints, curves, validation."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Generic, TypeVar, cast

import torch
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn
from tqdm import tqdm

from vnreg_train.training.checkpoint import (
    read_checkpoint,
    restore_training_state,
    save_checkpoint,
    training_state,
)
from vnreg_train.training.config import OptimisationConfig, RunConfig
from vnreg_train.training.curves import Curves, mean_figures, weight_figures
from vnreg_train.training.schedule import one_cycle

NetworkT = TypeVar("NetworkT", bound=nn.Module)
BatchT = TypeVar("BatchT")
Losses = tuple[Tensor, Mapping[str, Tensor]]


def begin_run(config: RunConfig) -> None:
    """Threads and seed; call before the network is made."""
    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)


class Trainer(ABC, Generic[NetworkT, BatchT]):
    """Network, average, optimiser and schedule, new or from the run's checkpoint.

    name: of the checkpoint and of the folder of curves. Batch i must not depend on what was
    trained before it; then a run that was stopped goes on as if it had not been.
    """

    def __init__(
        self,
        name: str,
        network: NetworkT,
        parameters: Sequence[nn.Parameter],
        config: RunConfig,
        settings: OptimisationConfig,
        run_folder: Path,
    ) -> None:
        self.name, self.network, self.run_folder = name, network, run_folder
        self.run_config, self.settings, self.parameters = config, settings, parameters
        self.average = AveragedModel(
            network, multi_avg_fn=get_ema_multi_avg_fn(settings.ema_decay), use_buffers=True
        )
        self.optimizer = torch.optim.AdamW(
            parameters, lr=settings.learning_rate, weight_decay=settings.weight_decay
        )
        self.schedule = one_cycle(
            self.optimizer, settings.learning_rate, settings.steps, settings.warmup
        )
        self.step = self.skipped = 0
        self._window: list[dict[str, float]] = []  # figures of the steps since the last log
        if self.checkpoint.exists():
            self._restore()
        else:
            self._choose_first_weights()

    @abstractmethod
    def _choose_first_weights(self) -> None:
        """Of a new run; both of the network and of the average."""

    @abstractmethod
    def _losses(self, batch: BatchT) -> Losses:
        """What to reduce, and its terms and figures, numbers each."""

    @abstractmethod
    def _batches(self) -> Iterable[BatchT]:
        """Those from the present step to the last."""

    @abstractmethod
    def _validate(self) -> dict[str, float]:
        """Figures of the averaged weights on shapes that are not trained on; {} without such."""

    def _speed(self, pairs_per_second: float) -> dict[str, float]:
        """The figures of throughput."""
        return {"pairs_per_second": pairs_per_second}

    @property
    def checkpoint(self) -> Path:
        return self.run_folder / f"{self.name}.pt"

    def averaged(self) -> NetworkT:
        """The network with the averaged weights, in evaluation mode."""
        return cast(NetworkT, self.average.module.eval())

    def save(self) -> None:
        state = training_state(
            self.name,
            self.step,
            self.network,
            self.average,
            self.optimizer,
            self.schedule,
            asdict(self.run_config),
        )
        save_checkpoint(self.checkpoint, **state, skipped=self.skipped, window=self._window)

    def _restore(self) -> None:
        state = read_checkpoint(self.checkpoint)
        self.step = restore_training_state(
            state, self.network, self.average, self.optimizer, self.schedule
        )
        # Checkpoints of the first version have neither.
        self.skipped, self._window = state.get("skipped", 0), state.get("window", [])

    def train_step(self, batch: BatchT) -> dict[str, float]:
        """One optimiser step. A step whose gradient is not finite is skipped and counted."""
        loss, terms = self._losses(batch)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        norm = nn.utils.clip_grad_norm_(self.parameters, self.settings.clip_norm)
        if torch.isfinite(norm):
            self.optimizer.step()
            self.average.update_parameters(self.network)
        else:
            self.skipped += 1
        self.schedule.step()
        self.step += 1
        figures = {name: float(value.detach()) for name, value in terms.items()}
        return figures | {"loss": float(loss.detach()), "gradient_norm": float(norm)}

    def run(self, max_minutes: float = float("inf"), progress: bool = True) -> None:
        """Trains until the last step or for so many minutes; saves at intervals and at the end."""
        curves = Curves(self.run_folder / "tensorboard" / self.name, self.step)
        steps = self.settings.steps
        bar = tqdm(total=steps, initial=self.step, disable=not progress, mininterval=10.0)
        started = last_saved = last = time.monotonic()
        seconds = 0.0  # waiting for batches included, saving and validation not
        first = self.step
        for batch in self._batches():
            self._window.append(self.train_step(batch))
            bar.update()
            now = time.monotonic()
            seconds += now - last
            if self.step % self.run_config.log_steps == 0:
                rate = (self.step - first) * self.settings.batch / seconds
                bar.set_postfix({k: f"{v:.3g}" for k, v in self._log(curves, rate).items()})
                first, seconds = self.step, 0.0
            if self._is_validation_step():
                curves.add("validation", self._validate(), self.step)
            if now - last_saved > 60 * self.run_config.checkpoint_minutes:
                self.save()
                last_saved = now
            if now - started > 60 * max_minutes:
                break
            last = time.monotonic()
        bar.close()
        curves.close()
        self.save()

    def _is_validation_step(self) -> bool:
        every = self.run_config.validation_steps
        return every > 0 and (self.step % every == 0 or self.step == self.settings.steps)

    def _log(self, curves: Curves, pairs_per_second: float) -> dict[str, float]:
        """A point on every curve; returns the means of the steps since the last one."""
        figures = mean_figures(self._window)
        self._window = []
        norm = figures.pop("gradient_norm")
        curves.add("train", figures, self.step)
        rate = float(self.schedule.get_last_lr()[0])
        optimiser = {"learning_rate": rate, "gradient_norm": norm, "skipped": float(self.skipped)}
        curves.add("optimiser", optimiser, self.step)
        curves.add("weights", weight_figures(self.network, self.average.module), self.step)
        curves.add("speed", self._speed(pairs_per_second), self.step)
        return figures
