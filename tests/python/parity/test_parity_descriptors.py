"""The network `vnreg`: the engine's stages against torch's in float64."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from parity_pairs import Points, make_test_pair, normalised_error
from parity_twin import ROOT
from scipy.spatial.transform import Rotation

import vnreg
from vnreg_train.export.descriptor_golden import export_descriptor_golden
from vnreg_train.export.descriptor_model import export_descriptor_model, import_descriptor_model
from vnreg_train.export.descriptor_reference import DescriptorReference
from vnreg_train.model_file import read_checksum, read_model
from vnreg_train.networks.descriptor import DescriptorNetwork
from vnreg_train.networks.descriptor_config import DescriptorConfig

LIMIT = 1e-5
# Rotating moves the points by rounding, and the 1e-7 of a vector's length that this is grows.
TURNED_LIMIT = 1e-4
MODELS = ["shipped", "default", "odd"]
CONFIGS = {
    "default": DescriptorConfig(),
    "odd": DescriptorConfig(
        channels=13,
        scalars=21,
        gates=3,
        products=3,
        local_descriptor=9,
        context_descriptor=17,
        frames=5,
        global_channels=7,
        local_blocks=1,
        context_blocks=2,
        moment_radii=(0.3, 0.7, 1.1),
        neighbourhood_radii=(0.4, 0.9),
    ),
}
ENCODED = 200  # of the random models: fewer than most clouds of the tests have
INVARIANT = ("descriptor.local", "descriptor.context", "significance", "overlap", "moments.scalars")
EQUIVARIANT = ("frames.local", "frames.context", "moments.local", "moments.context", "context.v")
Stages = dict[str, NDArray[np.generic]]


@dataclass
class DescriptorTwin:
    """One model, run by torch and by the engine."""

    path: Path

    def __post_init__(self) -> None:
        self.model = vnreg.Model.load(self.path)
        self.reference = DescriptorReference(import_descriptor_model(self.path)[0])
        self.recorder = vnreg.Registrar(self.model, mode="coarse", record_stages=True)

    def engine(self, source: Points, target: Points) -> Stages:
        assert self.recorder.align(source, target).has_pose
        return dict(self.recorder.stages())

    def exact(self, source: Points, target: Points, stages: Stages) -> Stages:
        """Torch's stages for the points that the engine has encoded."""
        chosen = (stages["source.encoded"].astype(int), stages["target.encoded"].astype(int))
        return self.reference.describe(source, target, chosen)


def random_descriptor_network(config: DescriptorConfig) -> DescriptorNetwork:
    """Weights of the size of trained ones, and input scales that are not 1."""
    generator = torch.Generator().manual_seed(3)
    network = DescriptorNetwork(config)
    for parameter in network.parameters():
        size = parameter.shape[1] ** -0.5 if parameter.ndim == 2 else 0.3
        parameter.data.normal_(0, size, generator=generator)
    for name, buffer in network.named_buffers():
        buffer.uniform_(0.5, 2.0, generator=generator)
        assert name.endswith(("_scale", "_mean"))
    return network.eval()


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], DescriptorTwin]:
    folder = tmp_path_factory.mktemp("descriptors")
    made: dict[str, DescriptorTwin] = {}

    def get(name: str) -> DescriptorTwin:
        if name not in made:
            path = folder / f"{name}.vnr"
            if name == "shipped":
                path = Path(os.environ.get("VNREG_DESCRIPTOR_MODEL", ROOT / "models/vnreg.vnr"))
            else:
                network = random_descriptor_network(CONFIGS[name])
                export_descriptor_model(network, path, name, encoded=ENCODED)
            made[name] = DescriptorTwin(path)
        return made[name]

    return get


@pytest.mark.parametrize("sizes", [(1024, 1024), (333, 250), (64, 1024), (24, 25)])
@pytest.mark.parametrize("name", MODELS)
def test_every_stage_equals_torch_in_float64(
    name: str, sizes: tuple[int, int], twin: Callable[[str], DescriptorTwin]
) -> None:
    model = twin(name)
    pair = make_test_pair(1, *sizes, noisy=True)
    stages = model.engine(pair.source, pair.target)
    exact = model.exact(pair.source, pair.target, stages)
    assert set(exact) | {"source.encoded", "target.encoded"} == set(stages)
    for stage, expected in exact.items():
        actual = stages[stage].reshape(expected.shape)
        assert normalised_error(actual, expected) <= LIMIT, stage


def test_as_many_points_are_encoded_as_the_file_says(
    twin: Callable[[str], DescriptorTwin],
) -> None:
    pair = make_test_pair(2, 1024, 150, noisy=False)
    stages = twin("odd").engine(pair.source, pair.target)
    for side, count in (("source", ENCODED), ("target", 150)):
        assert len(np.unique(stages[f"{side}.encoded"])) == count
        assert len(stages[f"{side}.significance"]) == count


def test_a_golden_file_holds_what_the_engine_computes(
    twin: Callable[[str], DescriptorTwin], tmp_path: Path
) -> None:
    model = twin("odd")
    pair = make_test_pair(3, 90, 70, noisy=False)
    export_descriptor_golden(model.path, tmp_path / "golden.vnr", pair.source, pair.target)
    metadata, tensors = read_model(tmp_path / "golden.vnr")
    assert metadata["model.crc"] == read_checksum(model.path)
    stages = model.engine(pair.source, pair.target)
    assert {f"stage.{name}" for name in stages} == {k for k in tensors if k.startswith("stage.")}
    for name, value in stages.items():
        assert normalised_error(value, tensors[f"stage.{name}"]) <= LIMIT, name


def by_index(stages: Stages, side: str, stage: str) -> NDArray[np.generic]:
    """Rows of a stage in the order of the points' indices; vectors as (points, vectors, 3)."""
    rows = stages[f"{side}.{stage}"][np.argsort(stages[f"{side}.encoded"])]
    return rows.reshape(len(rows), -1, 3) if stage in EQUIVARIANT else rows


@pytest.mark.parametrize("size", [64, 150, 512])
@pytest.mark.parametrize("name", ["shipped", "default"])
def test_features_turn_with_the_cloud_or_not_at_all(
    name: str, size: int, twin: Callable[[str], DescriptorTwin]
) -> None:
    """The same points are encoded, because their indices are the same."""
    model = twin(name)
    rng = np.random.default_rng(size)
    points = make_test_pair(4, size, size, noisy=False).source
    for _ in range(3):
        rotation = Rotation.random(rng=rng).as_matrix()
        stages = model.engine(points, points @ rotation.T + rng.uniform(-9, 9, 3))
        for stage in INVARIANT:
            error = normalised_error(
                by_index(stages, "target", stage), by_index(stages, "source", stage)
            )
            assert error <= TURNED_LIMIT, stage
        for stage in EQUIVARIANT:
            expected = by_index(stages, "source", stage) @ rotation.T
            assert normalised_error(by_index(stages, "target", stage), expected) <= TURNED_LIMIT
        expected = stages["source.global"] @ rotation.T
        assert normalised_error(stages["target.global"], expected) <= 10 * TURNED_LIMIT


def test_the_order_of_the_points_changes_rounding_only(
    twin: Callable[[str], DescriptorTwin],
) -> None:
    model = twin("default")
    pair = make_test_pair(5, 180, 170, noisy=True)  # all are encoded
    order = np.random.default_rng(0).permutation(180)
    straight = model.engine(pair.source, pair.target)
    shuffled = model.engine(pair.source[order], pair.target)
    for stage in (*INVARIANT, *EQUIVARIANT):
        expected = by_index(straight, "source", stage)[order]
        assert normalised_error(by_index(shuffled, "source", stage), expected) <= LIMIT, stage
    assert normalised_error(shuffled["source.global"], straight["source.global"]) <= LIMIT


def test_far_points_change_no_local_descriptor(twin: Callable[[str], DescriptorTwin]) -> None:
    """Moving a part beyond moments and neighbourhood leaves the local branch as it was."""
    model = twin("default")
    rng = np.random.default_rng(6)
    near = rng.normal(size=(80, 3)) * 0.1
    far = rng.normal(size=(80, 3)) * 0.1 + [4.0, 0, 0]
    moved = far @ Rotation.random(rng=rng).as_matrix().T  # about the origin: to another place
    clouds = [np.concatenate([near, part]) for part in (far, moved)]
    # The rest of the frame: centroid and radius are of both clouds together, so they stay.
    stages = model.engine(clouds[0], clouds[1])
    local = [by_index(stages, side, "descriptor.local")[:80] for side in ("source", "target")]
    context = [by_index(stages, side, "descriptor.context")[:80] for side in ("source", "target")]
    assert normalised_error(local[1], local[0]) <= TURNED_LIMIT
    assert normalised_error(context[1], context[0]) > 1e-2
