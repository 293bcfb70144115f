// The sources of `vnreg align`: names of files, folders of clouds, and patterns.
#pragma once

#include <string>
#include <vector>

namespace vnreg::cli {

/// True if `sources` may be more than one file: several, a folder, or a name with *, ? or [ that
/// no file has.
bool is_many(const std::vector<std::string>& sources);

/// The files, in the order of `sources`: of a folder those with an extension of a cloud, of a
/// pattern those that match, each by name. Throws CommandError where there is none.
std::vector<std::string> list_sources(const std::vector<std::string>& sources);

}  // namespace vnreg::cli
