"""The rigid pose between two point clouds of one object, from any starting pose.

result = vnreg.align(source, target)    # arrays (N, 3), (M, 3); any unit
result.T_target_source                  # (4, 4): target = R source + t
result.status, result.confidence        # 'ok' and how sure it is

For many pairs keep a Registrar; Model.load reads weights other than the built-in ones.
"""

from vnreg._vnreg import (
    Alternative,
    Error,
    Model,
    Registrar,
    Result,
    __version__,
    align,
    instruction_set,
)

__all__ = [
    "Alternative",
    "Error",
    "Model",
    "Registrar",
    "Result",
    "__version__",
    "align",
    "instruction_set",
]
