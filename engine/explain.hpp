// What an answer was found by, read from the working memory after the call.
#pragma once

#include "engine/workspace.hpp"

namespace vnreg::detail {

/// Of the call that gave `result` and left its memory in the workspace, as far as it came
/// (Workspace::reached). Throws std::bad_alloc only.
Explanation explain(const Workspace& workspace, const Result& result);

}  // namespace vnreg::detail
