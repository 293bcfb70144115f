// Files that appear complete or not at all.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace vnreg::cloud_file {

/// Writes the parts one behind the other to a new file beside `path`, then renames it. A link is
/// followed; only files are replaced. Throws CloudFileError, whose text begins with the path.
void write_whole_file(const std::string& path, std::initializer_list<std::string_view> parts);

/// Writes all of `bytes` to an open file; false (see errno) where it cannot.
bool write_fully(int descriptor, std::string_view bytes);

}  // namespace vnreg::cloud_file
