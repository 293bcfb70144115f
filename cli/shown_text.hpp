// Names of files and messages as they may stand in JSON, CSV and tables.
#pragma once

#include <string>
#include <string_view>

namespace vnreg::cli {

/// `bytes` as one line of valid UTF-8: control characters, and bytes that belong to no well-formed
/// character, become \xNN. Names of files are bytes, and JSON is not.
std::string shown_text(std::string_view bytes);

}  // namespace vnreg::cli
