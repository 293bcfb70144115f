// `vnreg align` with several sources: each is moved onto the one target.
#pragma once

#include <string>
#include <vector>

#include "align_command.hpp"

namespace vnreg::cli {

/// One row a source; what is wrong with a source is said in its row. The exit code is that of the
/// worst: input, then not sure. Throws CommandError or CloudFileError about the target and the
/// model.
Outcome align_many(const AlignArguments& arguments, const std::vector<std::string>& sources,
                   const std::string& target);

}  // namespace vnreg::cli
