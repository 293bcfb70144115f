"""One pair through the engine and through torch, each program at most once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from parity_pairs import Stages, TestPair
from parity_twin import Twin
from stage_recomputation import StageRecomputation


@dataclass
class Run:
    """Lazily computed stages of one pair."""

    model: Twin
    pair: TestPair

    @cached_property
    def engine(self) -> Stages:
        return self.model.engine(self.pair.source, self.pair.target)

    @cached_property
    def alone(self) -> Stages:
        """Torch's stages, each from the engine's inputs."""
        return StageRecomputation(self.model.network, self.engine).all()

    @cached_property
    def torch32(self) -> Stages:
        return self.model.reference(self.pair.source, self.pair.target)

    @cached_property
    def torch64(self) -> Stages:
        return self.model.exact(self.pair.source, self.pair.target)
