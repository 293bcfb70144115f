"""Mode paper against torch on random small networks: any widths, switches, weights and clouds."""

from __future__ import annotations

import os
import tempfile
from dataclasses import replace
from pathlib import Path

from hypothesis import example, given, note, settings
from hypothesis import strategies as st
from parity_errors import error_alone
from parity_pairs import make_test_pair
from parity_run import Run
from parity_twin import Twin
from random_network import random_network

from vnreg_train.export.model import export_model
from vnreg_train.networks.config import NetworkConfig

# Single layers of few channels may cancel, so an order above what trained widths keep to.
LIMIT = 1e-4
MOST_POINTS = 160
EXAMPLES = int(os.environ.get("VNREG_FUZZ_NETWORKS", "12"))

CONFIGS = st.builds(
    NetworkConfig,
    global_channels=st.integers(4, 24),
    local_channels=st.integers(1, 6).map(lambda n: 4 * n),
    descriptor_channels=st.integers(1, 20),
    pair_channels=st.integers(2, 12),
    significance_channels=st.tuples(st.integers(1, 12), st.integers(1, 8)),
    neighbours=st.integers(2, 30),
    shared_direction=st.booleans(),
    fine_iterations=st.integers(1, 4),
    keep_divisor=st.integers(1, 8),
    input_rms_radius=st.sampled_from([0.0, 0.33, 1.0]),
    shared_encoder=st.booleans(),
    invariant_layer=st.booleans(),
)
NEARLY_EQUAL_SIGNIFICANCES = NetworkConfig(
    global_channels=4,
    local_channels=16,
    descriptor_channels=1,
    pair_channels=2,
    significance_channels=(9, 3),
    neighbours=2,
    fine_iterations=1,
    keep_divisor=1,
)
ABLATION = NetworkConfig(
    global_channels=16, local_channels=12, neighbours=8, shared_encoder=False, invariant_layer=False
)


@settings(max_examples=EXAMPLES, deadline=None)
@given(
    config=CONFIGS,
    seed=st.integers(0, 2**31),
    sizes=st.tuples(st.integers(64, MOST_POINTS), st.integers(64, MOST_POINTS)),
    noisy=st.booleans(),
)
@example(config=NEARLY_EQUAL_SIGNIFICANCES, seed=40, sizes=(64, 64), noisy=False)
@example(config=ABLATION, seed=1, sizes=(130, 97), noisy=True)
@example(config=replace(ABLATION, invariant_layer=True), seed=2, sizes=(90, 64), noisy=False)
def test_every_stage_of_a_random_network(
    config: NetworkConfig, seed: int, sizes: tuple[int, int], noisy: bool
) -> None:
    network = random_network(config, seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "random.vnr"
        export_model(network, path, "random")
        twin = Twin("random", network, path, max_points=MOST_POINTS)
        pair = Run(twin, make_test_pair(seed, *sizes, noisy))
    for stage in pair.alone:
        error = error_alone(stage, pair.engine, pair.alone)
        note(f"{stage}: {error}")
        assert error <= LIMIT, stage
