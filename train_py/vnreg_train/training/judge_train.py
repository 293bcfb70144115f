"""Trains the judge on poses that the engine proposes, and puts it into the model file.

Two losses on one number, the log-odds z of a pose: that among the poses of a pair a right one has
the largest z (listwise, over pairs that have one), and that z is the log-odds of being right.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn
from tqdm import trange

from vnreg_train.model_file import MetadataValue, read_model, write_model
from vnreg_train.networks.judge import JudgeNetwork
from vnreg_train.training.judge_samples import KEPT_POINTS, JudgeSamples
from vnreg_train.training.schedule import one_cycle

KEY = "channels.judge"
# What the judge has to decide on: every row of P1 and of views, and the paper's with its shared
# points.
ROWS = (
    "P1/independent",
    "P1/noise_0.01",
    "P1/noise_0.02",
    "P1/density",
    "P1/uneven",
    "P1/outliers",
    "P1/partial_75",
    "P1/partial_50",
    "P1/partial_75_noise_0.01",
    "P1/partial_50_noise_0.01",
    "P1/all",
    "views/scan_to_model",
    "views/two_scans",
    "P0/noisy/180",
    "P0/partial/180",
)


@dataclass(frozen=True)
class JudgeTraining:
    hidden: int = 48
    steps: int = 10000
    batch: int = 24  # pairs
    points: int = 96  # of each cloud, drawn anew for every step
    learning_rate: float = 3e-3
    weight_decay: float = 0.1
    average_decay: float = 0.99
    seed: int = 0


def judge_loss(z: Tensor, right: Tensor, there: Tensor) -> Tensor:
    """z (B, K) log-odds; right, there (B, K) bool."""
    never = torch.finfo(z.dtype).min
    among = z.masked_fill(~there, never)
    correct = z.masked_fill(~right, never)
    listwise = torch.logsumexp(among, 1) - torch.logsumexp(correct, 1)
    decidable = right.any(1)
    chosen = (listwise * decidable).sum() / decidable.sum().clamp(min=1)
    return chosen + binary_cross_entropy_with_logits(z[there], right[there].to(z.dtype))


def train_judge(
    samples: JudgeSamples, settings: JudgeTraining, progress: bool = True
) -> JudgeNetwork:
    """Raises ValueError where no pair has a right pose."""
    if not samples.right.any():
        raise ValueError("no pair has a right pose: there is nothing to learn")
    torch.manual_seed(settings.seed)
    points, fit = torch.from_numpy(samples.points), torch.from_numpy(samples.fit)
    right, there = torch.from_numpy(samples.right), torch.from_numpy(samples.there)
    network = JudgeNetwork(settings.hidden)
    network.fit_inputs(points[::8][there[::8]].flatten(0, 1).float())
    average = AveragedModel(network, multi_avg_fn=get_ema_multi_avg_fn(settings.average_decay))
    optimizer = torch.optim.AdamW(
        network.parameters(), settings.learning_rate, weight_decay=settings.weight_decay
    )
    schedule = one_cycle(
        optimizer, settings.learning_rate, settings.steps, warmup=0.1, cycle_momentum=True
    )
    for _ in trange(settings.steps, desc="judge", disable=not progress):
        pairs = torch.randint(0, len(samples), (settings.batch,))
        drawn = [torch.randperm(KEPT_POINTS)[: settings.points] for _ in range(2)]
        chosen = torch.cat([drawn[0], KEPT_POINTS + drawn[1]])
        z = network(points[pairs][:, :, chosen].float(), fit[pairs])
        loss = judge_loss(z, right[pairs], there[pairs])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        average.update_parameters(network)
    network.load_state_dict(average.module.state_dict())
    return network.eval()


def write_judge(source: Path, destination: Path, network: JudgeNetwork) -> None:
    """The same model with this judge, in place of its old one; calibrations go, they are of
    other poses."""
    metadata, tensors = read_model(source)
    kept: dict[str, MetadataValue] = {
        key: value for key, value in metadata.items() if not key.startswith("calibration.verified.")
    }
    others = {name: t for name, t in tensors.items() if not name.startswith("judge.")}
    hidden = {KEY: network.point1.out_features}
    write_model(destination, kept | hidden, others | network.tensors())
