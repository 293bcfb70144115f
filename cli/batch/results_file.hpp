// The results of a batch: rows in the order of the table, of which a killed run leaves the first.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "batch/pair_table.hpp"
#include "batch/result_row.hpp"
#include "batch/row_journal.hpp"

namespace vnreg::cli {

/// CSV and JSON lines are written row by row. Parquet has its index at its end, so its rows go to
/// PATH.rows.jsonl, of which finish() makes it.
class ResultsFile {
 public:
  /// The ending of `path` must be .csv, .jsonl or .parquet. Throws CommandError.
  explicit ResultsFile(const std::string& path);

  /// Begins the file, or goes on with one that was begun with the same `record` (run_record()) and
  /// the same pairs. Returns how many pairs have their row already.
  std::size_t begin_or_resume(const PairTable& table, const std::string& record, bool overwrite);

  /// Adds the row of the next pair.
  void add(const ResultRow& row);

  /// Everything is on the disk. `complete`: all pairs have their row.
  void finish(bool complete);

  /// How many rows have which status.
  const std::map<std::string, std::size_t>& statuses() const noexcept { return statuses_; }

 private:
  void begin();
  std::size_t resume(const PairTable& table);
  void write_parquet() const;

  std::string path_;
  bool parquet_;
  RowFormat format_;
  RowJournal journal_;
  std::string record_;
  std::map<std::string, std::size_t> statuses_;
  bool changed_ = false;
};

/// Empty, or why `path` cannot be the name of results.
std::string check_results_name(const std::string& path);

}  // namespace vnreg::cli
