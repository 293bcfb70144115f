"""ModelNet40 as it is downloaded: PointNet's files and the authors', and what they train."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from vnreg_train.data.modelnet40 import CATEGORIES
from vnreg_train.data.shapes import ShapesError, load_shapes
from vnreg_train.training.config import load_config
from vnreg_train.training.train import StageTrainer

POINTS = 2048


def unit_sphere_clouds(rows: int, seed: int) -> np.ndarray:
    """As PointNet's files have them: about their mean, the farthest point at distance 1."""
    rng = np.random.default_rng(seed)
    clouds = rng.normal(size=(rows, POINTS, 3)) * rng.uniform(0.2, 1, (rows, 1, 3))
    clouds -= clouds.mean(1, keepdims=True)
    clouds /= np.linalg.norm(clouds, axis=2).max(1)[:, None, None]
    return clouds.astype(np.float32)


@pytest.fixture
def ply_data(tmp_path: Path) -> Path:
    """modelnet40_ply_hdf5_2048: data, faceId, label and normal, two training files and one test."""
    for name, rows, seed in (("train0", 5, 1), ("train1", 3, 2), ("test0", 2, 3)):
        with h5py.File(tmp_path / f"ply_data_{name}.h5", "w") as file:
            file["data"] = unit_sphere_clouds(rows, seed)
            file["faceId"] = np.zeros((rows, POINTS), np.int32)
            file["label"] = np.arange(rows, dtype=np.uint8)[:, None]
            file["normal"] = np.zeros((rows, POINTS, 3), np.float32)
    (tmp_path / "shape_names.txt").write_text("\n".join(CATEGORIES) + "\n", encoding="utf-8")
    (tmp_path / "train_files.txt").write_text("data/ply_data_train0.h5\n", encoding="utf-8")
    return tmp_path


def test_pointnets_files_are_brought_to_longest_side_one(ply_data: Path) -> None:
    shapes = load_shapes(ply_data, "train")
    assert shapes.surface.shape == (8, POINTS, 3) and shapes.surface.dtype == np.float32
    assert shapes.queries is None and shapes.categories == CATEGORIES
    assert shapes.label.tolist() == [0, 1, 2, 3, 4, 0, 1, 2]
    assert shapes.names[0] == "ply_data_train0/0000" and len(set(shapes.names)) == 8
    assert np.allclose(np.ptp(shapes.surface, axis=1).max(1), 1, atol=1e-6)
    middle = (shapes.surface.max(1) + shapes.surface.min(1)) / 2
    assert np.abs(middle).max() < 1e-6
    assert len(load_shapes(ply_data, "test")) == 2
    assert load_shapes(ply_data, "train", points=100).surface.shape == (8, 100, 3)


def test_pointnets_files_without_names_have_modelnets_categories(ply_data: Path) -> None:
    (ply_data / "shape_names.txt").unlink()
    assert load_shapes(ply_data, "train").categories == CATEGORIES


def test_a_shape_that_is_one_point_is_refused(ply_data: Path) -> None:
    with h5py.File(ply_data / "ply_data_train1.h5", "a") as file:
        file["data"][1] = 0.5
    with pytest.raises(ShapesError, match="without extent"):
        load_shapes(ply_data, "train")


@pytest.fixture
def authors_files(tmp_path: Path) -> Path:
    """modelnet40_with_occupancy_label: data, label, points and occupancies, cut to few shapes."""
    rng = np.random.default_rng(4)
    for name, rows in (("train_0", 3), ("test_0", 2)):
        queries = rng.uniform(-0.5, 0.5, (rows, POINTS, 3)).astype(np.float32)
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            file["data"] = unit_sphere_clouds(rows, 5) / 2
            file["label"] = np.arange(rows)[:, None]
            file["points"] = queries
            file["occupancies"] = (np.linalg.norm(queries, axis=2) < 0.3).astype(np.float32)
    return tmp_path


@pytest.mark.parametrize("layout", ["authors_files", "ply_data"])
def test_the_papers_configuration_trains_on_either_layout(
    layout: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """Real widths and 1,024 points; only the batch is cut. Without queries the decoder rests."""
    shapes = load_shapes(request.getfixturevalue(layout), "train")
    config = replace(load_config("paper"), compile=False, threads=1)
    config = replace(config, coarse=replace(config.coarse, batch=1))
    run = StageTrainer(config, "coarse", shapes, tmp_path / "run")
    figures = run.train_step(run.batches[0])
    assert run.step == 1 and run.skipped == 0 and np.isfinite(figures["loss"])
    assert ("occupancy" in figures) == (layout == "authors_files")
