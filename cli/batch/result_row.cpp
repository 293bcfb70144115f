#include "batch/result_row.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "batch/csv.hpp"
#include "cloud_file/text_scan.hpp"
#include "shown_text.hpp"

namespace vnreg::cli {
namespace {

using Json = nlohmann::ordered_json;  // written in the order of the columns
// Read without one: a line of many names would take the square of their number.
using AnyJson = nlohmann::json;

// ---- CSV ----

std::string csv_text(const std::string& text) { return csv_field(text); }

std::string csv_text(std::int64_t number) { return std::to_string(number); }

std::string csv_text(double number) {
  if (!std::isfinite(number)) return "";
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.begin(), digits.end(), number).ptr;
  return {digits.begin(), end};
}

std::string csv_text(const std::optional<Pose>& pose) {
  std::string text;
  if (!pose) return text;
  for (const double number : *pose) {
    if (!text.empty()) text += ' ';
    text += csv_text(number);
  }
  return text;
}

bool parse_csv_text(const std::string& text, std::string& value) {
  value = text;
  return true;
}

bool parse_csv_text(const std::string& text, std::int64_t& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

bool parse_csv_text(const std::string& text, double& value) {
  if (text.empty()) return true;
  const auto number = cloud_file::parse_number(text);
  if (number) value = *number;
  return number.has_value();
}

bool parse_csv_text(const std::string& text, std::optional<Pose>& value) {
  if (text.empty()) return true;
  Pose pose{};
  std::string_view rest = text;
  for (double& number : pose) {
    const auto parsed = cloud_file::parse_number(cloud_file::next_word(rest));
    if (!parsed) return false;
    number = *parsed;
  }
  value = pose;
  return cloud_file::trimmed(rest).empty();
}

std::string csv_line(const ResultRow& row) {
  std::string line;
  for_each_column(row, [&](std::string_view name, const auto& field) {
    if (name != "row") line += ',';
    line += csv_text(field);
  });
  return line + '\n';
}

std::optional<ResultRow> parse_csv_row(std::string_view line) {
  const auto fields = split_csv(line);
  if (!fields) return std::nullopt;
  ResultRow row;
  std::size_t column = 0;
  bool good = true;
  for_each_column(row, [&](std::string_view, auto& field) {
    good = good && column < fields->size() && parse_csv_text((*fields)[column], field);
    ++column;
  });
  return good && column == fields->size() ? std::optional(row) : std::nullopt;
}

// ---- JSON lines ----

template <class T>
Json json_of(const T& value) {
  return value;  // the library writes NaN as null
}

Json json_of(const std::optional<Pose>& pose) { return pose ? Json(*pose) : Json(nullptr); }

std::string json_line(const ResultRow& row) {
  Json json;
  for_each_column(row, [&](const char* name, const auto& field) { json[name] = json_of(field); });
  if (row.error.empty()) json["error"] = nullptr;
  return json.dump() + '\n';
}

template <class T>
void read_json(const AnyJson& json, T& value) {
  if (!json.is_null()) json.get_to(value);
}

/// A fraction is left out: it may be too large for a whole number.
void read_json(const AnyJson& json, std::int64_t& value) {
  if (json.is_number_integer()) json.get_to(value);
}

void read_json(const AnyJson& json, std::optional<Pose>& value) {
  if (!json.is_null()) value = json.get<Pose>();
}

std::optional<ResultRow> parse_json_row(std::string_view line) {
  try {
    const AnyJson json = AnyJson::parse(line);
    ResultRow row;
    for_each_column(row, [&](const char* name, auto& field) { read_json(json.at(name), field); });
    return row;
  } catch (const AnyJson::exception&) {
    return std::nullopt;
  }
}

// ---- both ----

bool is_status(std::string_view name) {
  static constexpr std::string_view none = "unknown";  // beyond the last one
  if (name == ResultRow().status) return true;
  for (int i = 0;; ++i) {
    const std::string_view known = to_string(static_cast<Status>(i));
    if (known == none || known == name) return known != none;
  }
}

bool is_shown_text(const std::string& text) { return shown_text(text) == text; }

/// True if it is what this program puts into a row: statuses and messages reach terminals.
bool is_of_a_batch(const ResultRow& row) {
  return is_status(row.status) && is_shown_text(row.id) && is_shown_text(row.source) &&
         is_shown_text(row.target) && is_shown_text(row.error);
}

}  // namespace

void set_result(ResultRow& row, const Result& result) {
  row.status = to_string(result.status);
  row.points_source = static_cast<std::int64_t>(result.points_source);
  row.points_target = static_cast<std::int64_t>(result.points_target);
  row.ms = result.ms.total;
  if (!result.has_pose) return;
  row.T_target_source = result.T_target_source;
  row.confidence = result.confidence;
  row.overlap = result.overlap;
  row.rmse = result.rmse;
  row.inlier_distance = result.inlier_distance;
  row.score = result.score;
}

std::string rows_header(RowFormat format) {
  if (format == RowFormat::jsonl) return "";
  std::string line;
  const ResultRow row;
  for_each_column(row, [&](std::string_view name, const auto&) {
    if (!line.empty()) line += ',';
    line += name;
  });
  return line + '\n';
}

std::string row_line(const ResultRow& row, RowFormat format) {
  return format == RowFormat::csv ? csv_line(row) : json_line(row);
}

std::optional<ResultRow> parse_row(std::string_view line, RowFormat format) {
  auto row = format == RowFormat::csv ? parse_csv_row(line) : parse_json_row(line);
  if (!row || !is_of_a_batch(*row)) return std::nullopt;
  const std::string written = row_line(*row, format);
  const bool same = std::string_view(written).substr(0, written.size() - 1) == line;
  return same ? std::move(row) : std::nullopt;
}

}  // namespace vnreg::cli
