"""The training loop of the network `vnreg`."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.optim.lr_scheduler import OneCycleLR
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn
from torch.utils.tensorboard import SummaryWriter
from tqdm import tqdm

from vnreg_train.data.mixture import MixtureSampler, PaddedPairs
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.networks.descriptor import DescriptorNetwork, input_features, split_pair
from vnreg_train.training.checkpoint import (
    restore_training_state,
    save_checkpoint,
    training_state,
)
from vnreg_train.training.descriptor_config import DescriptorTrainingConfig
from vnreg_train.training.descriptor_losses import descriptor_losses

LOG_EVERY = 20  # steps
INPUT_BATCHES = 4  # whose statistics set the input scales


@dataclass
class DescriptorBatch:
    """Clouds stacked source first, then target, in network coordinates."""

    points: Tensor  # (2B, N, 3), each cloud about its own centroid; padding is zero
    mask: Tensor  # (2B, N): 1 for points, 0 for padding
    shift: Tensor  # (B, 3): target = source + shift


def network_batch(pairs: PaddedPairs) -> DescriptorBatch:
    """Centres the clouds and divides both by the larger of their r.m.s. radii."""
    clouds = np.concatenate([pairs.source, pairs.target]).astype(np.float64)
    counts = np.concatenate([pairs.source_count, pairs.target_count])
    mask = np.arange(clouds.shape[1]) < counts[:, None]
    centroid = clouds.sum(1) / counts[:, None]
    clouds = (clouds - centroid[:, None]) * mask[..., None]
    radius = np.sqrt(np.square(clouds).sum((1, 2)) / counts)
    half = len(pairs.source)
    scale = np.maximum(radius[:half], radius[half:])
    clouds /= np.tile(scale, 2)[:, None, None]
    shift = (centroid[:half] - centroid[half:]) / scale[:, None]
    points, weight, shift = (torch.from_numpy(a.astype(np.float32)) for a in (clouds, mask, shift))
    return DescriptorBatch(points, weight, shift)


class DescriptorTrainer:
    """Network, average, optimiser and schedule, new or from the run's checkpoint."""

    def __init__(
        self, config: DescriptorTrainingConfig, shapes: ShapeSet, run_folder: Path
    ) -> None:
        torch.set_num_threads(config.threads)
        torch.manual_seed(config.seed)
        self.config, self.run_folder, settings = config, run_folder, config.optimisation
        self.network = DescriptorNetwork(config.network)
        self.average = AveragedModel(
            self.network, multi_avg_fn=get_ema_multi_avg_fn(settings.ema_decay), use_buffers=True
        )
        self.optimizer = torch.optim.AdamW(
            self.network.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
        )
        self.schedule = OneCycleLR(
            self.optimizer,
            max_lr=settings.learning_rate,
            total_steps=settings.steps,
            pct_start=settings.warmup,
            cycle_momentum=False,
        )
        self.sampler = MixtureSampler(
            shapes,
            config.data.points,
            settings.batch,
            config.data.mixture,
            config.seed,
            anisotropic_batches=int(config.data.anisotropic_share * settings.steps),
        )
        compiled = config.compile
        self._losses = torch.compile(self._forward, dynamic=False) if compiled else self._forward
        self.step = self.skipped = 0
        if self.checkpoint.exists():
            state = torch.load(self.checkpoint, weights_only=True)
            self.step = restore_training_state(
                state, self.network, self.average, self.optimizer, self.schedule
            )
        else:
            self._fit_inputs()

    @property
    def checkpoint(self) -> Path:
        return self.run_folder / "vnreg.pt"

    def _fit_inputs(self) -> None:
        # Batches with numbers below zero are never trained on.
        batches = [network_batch(self.sampler.batch(-1 - i)) for i in range(INPUT_BATCHES)]
        points, mask = (torch.cat([getattr(b, k) for b in batches]) for k in ("points", "mask"))
        radii = self.config.network.moment_radii
        self.network.fit_inputs(input_features(points, mask, self.config.data.encoded, radii))
        self.average.module.load_state_dict(self.network.state_dict())

    def _forward(
        self, points: Tensor, mask: Tensor, shift: Tensor
    ) -> tuple[Tensor, dict[str, Tensor]]:
        config = self.config
        encoded = config.data.encoded
        with torch.no_grad():
            inputs = input_features(points, mask, encoded, config.network.moment_radii)
        centres = points[:, :encoded]
        with torch.autocast("cpu", torch.bfloat16, enabled=config.optimisation.bfloat16):
            features = self.network(centres, inputs)
        source, target = split_pair(features)
        x, y = centres.chunk(2)
        return descriptor_losses(source, target, x, y, shift, config.optimisation.weights)

    def save(self) -> None:
        save_checkpoint(
            self.checkpoint,
            **training_state(
                "vnreg",
                self.step,
                self.network,
                self.average,
                self.optimizer,
                self.schedule,
                asdict(self.config),
            ),
        )

    def train_step(self, batch: DescriptorBatch) -> dict[str, float]:
        """One optimiser step. A step whose gradient is not finite is skipped and counted."""
        loss, terms = self._losses(batch.points, batch.mask, batch.shift)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        norm = nn.utils.clip_grad_norm_(
            self.network.parameters(), self.config.optimisation.clip_norm
        )
        if torch.isfinite(norm):
            self.optimizer.step()
            self.average.update_parameters(self.network)
        else:
            self.skipped += 1
        self.schedule.step()
        self.step += 1
        figures = {name: float(value) for name, value in terms.items()}
        return figures | {"loss": float(loss), "gradient_norm": float(norm)}

    def run(self, max_minutes: float = float("inf"), progress: bool = True) -> None:
        """Trains until the last step or for so many minutes; saves at intervals and at the end."""
        settings = self.config.optimisation
        writer = SummaryWriter(str(self.run_folder / "tensorboard"))
        started = last_saved = time.monotonic()
        first, window = self.step, list[dict[str, float]]()
        bar = tqdm(total=settings.steps, initial=first, disable=not progress, mininterval=10.0)
        while self.step < settings.steps:
            batch = network_batch(self.sampler.batch(self.step))
            window.append(self.train_step(batch))
            bar.update()
            now = time.monotonic()
            if self.step % LOG_EVERY == 0:
                pairs = (self.step - first) * settings.batch / (now - started)
                figures = {k: float(np.mean([f[k] for f in window])) for k in window[0]}
                figures |= {"pairs_per_second": pairs, "skipped": self.skipped}
                for name, value in figures.items():
                    writer.add_scalar(name, value, self.step)
                bar.set_postfix({k: f"{v:.3g}" for k, v in figures.items()})
                window = []
            if now - last_saved > 60 * self.config.checkpoint_minutes:
                self.save()
                last_saved = now
            if now - started > 60 * max_minutes:
                break
        bar.close()
        writer.close()
        self.save()
