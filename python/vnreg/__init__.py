"""The rigid pose between two point clouds of one object, from any starting pose.

result = vnreg.align(source, target)    # arrays (N, 3), (M, 3); any unit
result.T_target_source                  # (4, 4): target = R source + t
result.status, result.confidence        # 'ok' and how sure it is

For many pairs keep a Registrar, whose prepare() reads a cloud once for many alignments, or use
align_many; Model.load reads weights other than the built-in ones.
"""

from vnreg._vnreg import (
    Alternative,
    Cancellation,
    Error,
    Model,
    PreparedCloud,
    Registrar,
    Result,
    __version__,
    align,
    align_many,
    instruction_set,
)

__all__ = [
    "Alternative",
    "Cancellation",
    "Error",
    "Model",
    "PreparedCloud",
    "Registrar",
    "Result",
    "__version__",
    "align",
    "align_many",
    "instruction_set",
]
