// Rows of comma-separated values, as RFC 4180 has them, except that no field spans lines.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vnreg::cli {

/// The fields of one line without its end; nothing where a quoted field does not end, or goes on
/// after its quote.
std::optional<std::vector<std::string>> split_csv(std::string_view line);

/// `field` as it stands in a row: in quotes where it holds a comma, a quote or blanks at its ends.
std::string csv_field(std::string_view field);

}  // namespace vnreg::cli
