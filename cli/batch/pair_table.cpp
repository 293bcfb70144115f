#include "batch/pair_table.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>

#include "batch/csv.hpp"
#include "cloud_file/cloud_file.hpp"
#include "cloud_file/text_scan.hpp"
#include "command.hpp"
#include "input.hpp"

namespace vnreg::cli {
namespace {

using Fields = std::vector<std::string>;

constexpr std::size_t no_column = std::numeric_limits<std::size_t>::max();

struct Columns {
  std::size_t source = 0;
  std::size_t target = 1;
  std::size_t id = no_column;
};

std::size_t column_of(const Fields& header, std::string_view name) {
  const auto is_name = [&](const std::string& field) { return cloud_file::trimmed(field) == name; };
  const auto found = std::ranges::find_if(header, is_name);
  return found == header.end() ? no_column : static_cast<std::size_t>(found - header.begin());
}

/// The columns that a header names; nothing if the first row is a pair.
std::optional<Columns> columns_of(const Fields& first, std::size_t line) {
  const Columns columns{column_of(first, "source"), column_of(first, "target"),
                        column_of(first, "id")};
  const bool has_source = columns.source != no_column;
  const bool has_target = columns.target != no_column;
  if (has_source != has_target) {
    cloud_file::fail_at_line(line, "the columns source and target",
                             has_source ? "source alone" : "target alone");
  }
  return has_source ? std::optional(columns) : std::nullopt;
}

const std::string& field_at(const Fields& fields, std::size_t column, const char* name,
                            std::size_t line) {
  if (column >= fields.size() || fields[column].empty()) {
    cloud_file::fail_at_line(
        line, std::string("a ") + name + " in column " + std::to_string(column + 1), "none");
  }
  // The system would open what stands before it.
  if (fields[column].find('\0') != std::string::npos) {
    cloud_file::fail_at_line(line, std::string("a ") + name + " without a zero byte",
                             cloud_file::quoted(fields[column]));
  }
  return fields[column];
}

Pair pair_of(const Fields& fields, const Columns& columns, std::size_t row, std::size_t line) {
  const std::string& source = field_at(fields, columns.source, "source", line);
  const std::string& target = field_at(fields, columns.target, "target", line);
  const bool has_id = columns.id < fields.size();
  return {has_id ? fields[columns.id] : std::to_string(row), source, target};
}

Fields fields_of(std::string_view text, std::size_t line) {
  std::optional<Fields> fields = split_csv(text);
  if (!fields) cloud_file::fail_at_line(line, "comma-separated fields", "a quote out of place");
  return *std::move(fields);
}

}  // namespace

std::string PairTable::path_of(const std::string& name) const {
  return (std::filesystem::path(folder) / name).string();
}

std::vector<Pair> parse_pairs(std::string_view bytes) {
  std::vector<Pair> pairs;
  std::optional<Columns> columns;
  cloud_file::LineReader lines(bytes);
  while (const auto text = lines.next()) {
    if (cloud_file::trimmed(*text).empty()) continue;
    const Fields fields = fields_of(*text, lines.line_number());
    if (!columns) {
      columns = columns_of(fields, lines.line_number());
      if (columns) continue;
      columns = Columns{};
    }
    pairs.push_back(pair_of(fields, *columns, pairs.size(), lines.line_number()));
  }
  return pairs;
}

PairTable read_pairs(const std::string& path) {
  try {
    const std::string folder =
        path == "-" ? "" : std::filesystem::path(path).parent_path().string();
    return {parse_pairs(read_input(path)), folder};
  } catch (const cloud_file::CloudFileError& error) {
    throw CommandError(ExitCode::input,
                       cloud_file::one_line(input_name(path)) + ": " + error.what());
  }
}

}  // namespace vnreg::cli
