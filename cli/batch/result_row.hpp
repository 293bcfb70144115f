// One row of the results of a batch; docs/cli.md lists the columns.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "vnreg/vnreg.hpp"

namespace vnreg::cli {

/// What is not known is NaN or nothing; text is as shown_text() has it.
struct ResultRow {
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

  std::int64_t row = 0;  // of the table, from 0
  std::string id;
  std::string source;
  std::string target;
  std::string status = "unreadable";  // or the name of a Status
  std::optional<Pose> T_target_source;
  double confidence = unknown;
  double overlap = unknown;
  double rmse = unknown;
  double inlier_distance = unknown;
  double score = unknown;
  std::int64_t points_source = 0;
  std::int64_t points_target = 0;
  double ms = unknown;
  std::string error;  // empty: none
};

/// Calls visit(name, field) for every column in order: the one list of them in the program.
template <class Row, class Visit>
void for_each_column(Row& row, Visit visit) {
  visit("row", row.row);
  visit("id", row.id);
  visit("source", row.source);
  visit("target", row.target);
  visit("status", row.status);
  visit("T_target_source", row.T_target_source);
  visit("confidence", row.confidence);
  visit("overlap", row.overlap);
  visit("rmse", row.rmse);
  visit("inlier_distance", row.inlier_distance);
  visit("score", row.score);
  visit("points_source", row.points_source);
  visit("points_target", row.points_target);
  visit("ms", row.ms);
  visit("error", row.error);
}

/// Fills in what the engine said.
void set_result(ResultRow& row, const Result& result);

/// How rows are kept in a file of lines.
enum class RowFormat { csv, jsonl };

/// What stands before the rows: the names of the columns, or nothing.
std::string rows_header(RowFormat format);

/// One line with its end. Numbers have as many digits as give the same double back.
std::string row_line(const ResultRow& row, RowFormat format);

/// The row of a line without its end; nothing if it is no line that row_line() writes.
std::optional<ResultRow> parse_row(std::string_view line, RowFormat format);

}  // namespace vnreg::cli
