"""The training of the network `vnreg`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import torch
from torch import Tensor

from vnreg_train.data.mixture import MixtureSampler
from vnreg_train.data.shapes import ShapeSet
from vnreg_train.networks.descriptor import DescriptorNetwork, input_features, split_pair
from vnreg_train.training.descriptor_batches import DescriptorBatch, network_batch
from vnreg_train.training.descriptor_config import DescriptorTrainingConfig
from vnreg_train.training.descriptor_losses import descriptor_losses
from vnreg_train.training.descriptor_validation import validate
from vnreg_train.training.loop import Losses, Trainer, begin_run

INPUT_BATCHES = 4  # whose statistics set the input scales
VALIDATION_RECIPES = ("independent", "partial_75_noisy")


class DescriptorTrainer(Trainer[DescriptorNetwork, DescriptorBatch]):
    """A run of the network `vnreg`. validation: shapes to measure the averaged weights on."""

    def __init__(
        self,
        config: DescriptorTrainingConfig,
        shapes: ShapeSet,
        run_folder: Path,
        validation: ShapeSet | None = None,
    ) -> None:
        begin_run(config)
        self.config, self.validation, settings = config, validation, config.optimisation
        self.sampler = MixtureSampler(
            shapes,
            config.data.points,
            settings.batch,
            config.data.mixture,
            config.seed,
            anisotropic_batches=int(config.data.anisotropic_share * settings.steps),
        )
        compiled = config.compile
        self._forward = torch.compile(self._features, dynamic=False) if compiled else self._features
        network = DescriptorNetwork(config.network)
        super().__init__("vnreg", network, [*network.parameters()], config, settings, run_folder)

    def _choose_first_weights(self) -> None:
        # Batches with numbers below zero are never trained on.
        batches = [network_batch(self.sampler.batch(-1 - i)) for i in range(INPUT_BATCHES)]
        points, mask = (torch.cat([getattr(b, k) for b in batches]) for k in ("points", "mask"))
        radii = self.config.network.moment_radii
        self.network.fit_inputs(input_features(points, mask, self.config.data.encoded, radii))
        self.average.module.load_state_dict(self.network.state_dict())

    def _batches(self) -> Iterator[DescriptorBatch]:
        for index in range(self.step, self.settings.steps):
            yield network_batch(self.sampler.batch(index))

    def _losses(self, batch: DescriptorBatch) -> Losses:
        return self._forward(batch.points, batch.mask, batch.shift)

    def _features(
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

    def _validate(self) -> dict[str, float]:
        if self.validation is None:
            return {}
        network, points = self.averaged(), self.config.data.points
        return {
            f"{recipe}/{name}": value
            for recipe in VALIDATION_RECIPES
            for name, value in validate(network, self.validation, recipe, points).items()
        }
