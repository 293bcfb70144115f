"""What a call from Python costs beyond the call of C++ within it."""

from __future__ import annotations

import statistics
import time

import numpy as np
import pytest

import vnreg

LIMIT_US = 50


@pytest.mark.alone
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("order", ["C", "F"])
def test_the_overhead_of_a_call_is_small(dtype: type, order: str) -> None:
    rng = np.random.default_rng(0)
    source = np.asarray(rng.normal(size=(1024, 3)) * [1, 0.6, 0.3], dtype=dtype, order=order)
    target = np.asarray(source[:, [1, 2, 0]], dtype=dtype, order=order)
    registrar = vnreg.Registrar(mode="coarse")
    beyond_us = []
    for _ in range(40):
        started = time.perf_counter()
        result = registrar.align(source, target)
        whole_ms = 1000 * (time.perf_counter() - started)
        beyond_us.append(1000 * (whole_ms - result.ms["total"]))
    median = statistics.median(beyond_us)
    print(f"\n{np.dtype(dtype).name}, order {order}: {median:.1f} us beyond the call of C++")
    assert 0 < median < LIMIT_US
