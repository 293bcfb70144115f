#include "batch/csv.hpp"

#include <algorithm>

#include "cloud_file/text_scan.hpp"

namespace vnreg::cli {
namespace {

/// Takes a field that begins with a quote off the front of `rest`; two quotes stand for one.
std::optional<std::string> take_quoted(std::string_view& rest) {
  std::string field;
  for (std::size_t i = 1; i < rest.size(); ++i) {
    if (rest[i] != '"') {
      field += rest[i];
    } else if (i + 1 < rest.size() && rest[i + 1] == '"') {
      field += '"';
      ++i;
    } else {
      rest.remove_prefix(i + 1);
      return field;
    }
  }
  return std::nullopt;
}

std::string take_plain(std::string_view& rest) {
  const std::size_t end = std::min(rest.find(','), rest.size());
  std::string field(rest.substr(0, end));
  rest.remove_prefix(end);
  return field;
}

}  // namespace

std::optional<std::vector<std::string>> split_csv(std::string_view line) {
  std::vector<std::string> fields;
  for (;;) {
    std::optional<std::string> field = line.starts_with('"') ? take_quoted(line) : take_plain(line);
    if (!field) return std::nullopt;
    fields.push_back(std::move(*field));
    if (line.empty()) return fields;
    if (line.front() != ',') return std::nullopt;
    line.remove_prefix(1);
  }
}

std::string csv_field(std::string_view field) {
  const bool plain = field.find_first_of(",\"") == std::string_view::npos &&
                     (field.empty() || (!cloud_file::is_blank(field.front()) &&
                                        !cloud_file::is_blank(field.back())));
  if (plain) return std::string(field);
  std::string text = "\"";
  for (const char c : field) text += c == '"' ? "\"\"" : std::string(1, c);
  return text + '"';
}

}  // namespace vnreg::cli
