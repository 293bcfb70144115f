import os
from collections.abc import Iterable
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Mode = Literal["coarse", "paper", "verified"]
_Status = Literal[
    "ok",
    "low_confidence",
    "ambiguous",
    "too_few_points",
    "not_finite",
    "degenerate",
    "timed_out",
    "cancelled",
    "scales_differ",
]
# Any: the clouds and meshes of Open3D and trimesh, which need not be installed.
_Cloud: TypeAlias = ArrayLike | PreparedCloud | Any

__version__: str

def instruction_set() -> str: ...
def parse_cloud(content: bytes, name: str = "") -> NDArray[np.float64]: ...

class Error(RuntimeError):
    code: str
    field: str
    expected: str
    got: str

class Model:
    @staticmethod
    def load(path: str | os.PathLike[str]) -> Model: ...
    @staticmethod
    def from_bytes(content: bytes) -> Model: ...
    @staticmethod
    def builtin() -> Model: ...
    @property
    def name(self) -> str: ...
    @property
    def points(self) -> int: ...
    @property
    def min_points(self) -> int: ...

class Alternative:
    @property
    def T_target_source(self) -> NDArray[np.float64]: ...
    @property
    def score(self) -> float: ...

class Result:
    @property
    def status(self) -> _Status: ...
    @property
    def has_pose(self) -> bool: ...
    @property
    def T_target_source(self) -> NDArray[np.float64]: ...
    @property
    def T_target_source_coarse(self) -> NDArray[np.float64]: ...
    @property
    def covariance(self) -> NDArray[np.float64]: ...
    @property
    def confidence(self) -> float: ...
    @property
    def overlap(self) -> float: ...
    @property
    def rmse(self) -> float: ...
    @property
    def inlier_distance(self) -> float: ...
    @property
    def score(self) -> float: ...
    @property
    def alternatives(self) -> list[Alternative]: ...
    @property
    def evidence(self) -> dict[str, float]: ...
    @property
    def points_source(self) -> int: ...
    @property
    def points_target(self) -> int: ...
    @property
    def dropped_source(self) -> int: ...
    @property
    def dropped_target(self) -> int: ...
    @property
    def ms(self) -> dict[str, float]: ...

class Explanation:
    @property
    def source(self) -> NDArray[np.float64]: ...
    @property
    def target(self) -> NDArray[np.float64]: ...
    @property
    def source_significance(self) -> NDArray[np.float64]: ...
    @property
    def target_significance(self) -> NDArray[np.float64]: ...
    @property
    def matches(self) -> NDArray[np.int64]: ...
    @property
    def match_weights(self) -> NDArray[np.float64]: ...
    @property
    def hypotheses(self) -> list[Alternative]: ...

VIEW_PLACEHOLDER: str

def view_template() -> str: ...
def _view_data(
    source: ArrayLike | Any,
    target: ArrayLike | Any,
    result: Result,
    explanation: Explanation | None,
    source_name: str,
    target_name: str,
    model: str,
    mode: str,
) -> str: ...

class PreparedCloud:
    @property
    def status(self) -> _Status: ...
    def __len__(self) -> int: ...

class Cancellation:
    def __init__(self) -> None: ...
    def request(self) -> None: ...
    def reset(self) -> None: ...
    @property
    def requested(self) -> bool: ...

class Registrar:
    def __init__(
        self,
        model: Model | None = None,
        *,
        mode: _Mode = "verified",
        threads: int = 1,
        max_points: int = 0,
        seed: int = 0,
        record_stages: bool = False,
        time_budget_ms: float = 0.0,
        cancellation: Cancellation | None = None,
        drop_non_finite: bool = False,
    ) -> None: ...
    def align(self, source: _Cloud, target: _Cloud) -> Result: ...
    def prepare(self, cloud: ArrayLike | Any) -> PreparedCloud: ...
    def explain(self) -> Explanation: ...
    def stages(self) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]: ...

def align(
    source: _Cloud,
    target: _Cloud,
    *,
    model: Model | None = None,
    mode: _Mode = "verified",
    threads: int = 1,
    max_points: int = 0,
    seed: int = 0,
    time_budget_ms: float = 0.0,
    drop_non_finite: bool = False,
) -> Result: ...
def align_many(
    pairs: Iterable[tuple[_Cloud, _Cloud]],
    *,
    model: Model | None = None,
    mode: _Mode = "verified",
    threads: int = 0,
    max_points: int = 0,
    seed: int = 0,
    time_budget_ms: float = 0.0,
    drop_non_finite: bool = False,
) -> list[Result]: ...
