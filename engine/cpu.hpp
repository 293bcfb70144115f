// Whether the processor has the instructions that this build uses.
#pragma once

namespace vnreg::detail {

/// Throws Error (unsupported_cpu) when the processor lacks what this build was compiled for.
void require_cpu();

}  // namespace vnreg::detail
