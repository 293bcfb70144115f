// Files that a command is given: by name, or `-` for standard input.
#pragma once

#include <optional>
#include <string>

#include "cloud_file/cloud_file.hpp"

namespace vnreg::cli {

/// The name that messages call `path` by.
std::string input_name(const std::string& path);

/// All bytes of it. Throws CloudFileError, without its name.
std::string read_input(const std::string& path);

/// The points of it; `format` holds for standard input alone, nothing means by its content. Throws
/// CloudFileError, whose text begins with the name.
cloud_file::Points read_input_cloud(const std::string& path,
                                    std::optional<cloud_file::Format> format);

}  // namespace vnreg::cli
