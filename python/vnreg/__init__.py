"""The rigid pose between two point clouds of one object, from any starting pose.

result = vnreg.align(source, target)    # arrays (N, 3), (M, 3); any unit
result.T_target_source                  # (4, 4): target = R source + t
result.status, result.confidence        # 'ok' and how sure it is
vnreg.view(source, target, result)      # a page to look at, in a notebook or by .open()

For many pairs keep a Registrar, whose prepare() reads a cloud once for many alignments, or use
align_many; batch does tables of files, on many machines if need be, into parquet. Model.load reads
weights other than the built-in ones, read_cloud the formats of the program.
"""

from vnreg._batch import BatchReport, batch
from vnreg._clouds import read_cloud
from vnreg._view import View, view
from vnreg._vnreg import (
    VIEW_PLACEHOLDER,
    Alternative,
    Cancellation,
    Error,
    Explanation,
    Model,
    PreparedCloud,
    Registrar,
    Result,
    __version__,
    align,
    align_many,
    instruction_set,
    parse_cloud,
    view_template,
)

__all__ = [
    "VIEW_PLACEHOLDER",
    "Alternative",
    "BatchReport",
    "Cancellation",
    "Error",
    "Explanation",
    "Model",
    "PreparedCloud",
    "Registrar",
    "Result",
    "View",
    "__version__",
    "align",
    "align_many",
    "batch",
    "instruction_set",
    "parse_cloud",
    "read_cloud",
    "view",
    "view_template",
]
