#include "batch/results_file.hpp"

#include <filesystem>
#include <vector>

#include "batch/parquet_writer.hpp"
#include "batch/part_file.hpp"
#include "batch/run_record.hpp"
#include "command.hpp"
#include "shown_text.hpp"

namespace vnreg::cli {
namespace {

constexpr std::size_t rows_per_group = 16384;

std::string ending_of(const std::string& path) {
  return std::filesystem::path(path).extension().string();
}

std::string journal_path(const std::string& path) {
  return ending_of(path) == ".parquet" ? path + ".rows.jsonl" : path;
}

[[noreturn]] void refuse(const std::string& path, const std::string& expected,
                         const std::string& found) {
  throw CommandError(ExitCode::usage, path + ": expected " + expected + ", found " + found +
                                          "; name another output, or begin anew with --overwrite");
}

bool is_row_of(const ResultRow& row, std::size_t number, const Pair& pair) {
  return row.row == static_cast<std::int64_t>(number) && row.id == shown_text(pair.id) &&
         row.source == shown_text(pair.source) && row.target == shown_text(pair.target);
}

}  // namespace

std::string check_results_name(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == ".csv" || ending == ".jsonl" || ending == ".parquet") return "";
  return "expected a name that ends in .csv, .jsonl or .parquet, found " + path;
}

ResultsFile::ResultsFile(const std::string& path)
    : path_(path),
      parquet_(ending_of(path) == ".parquet"),
      format_(ending_of(path) == ".csv" ? RowFormat::csv : RowFormat::jsonl),
      journal_(journal_path(path)) {}

std::size_t ResultsFile::begin_or_resume(const PairTable& table, const std::string& record,
                                         bool overwrite) {
  record_ = record;
  const bool empty = journal_.empty();
  if (!overwrite && !empty) {
    check_record(record_path(path_), record);
    return resume(table);
  }
  if (!overwrite && parquet_ && std::filesystem::exists(path_)) {
    refuse(path_, "the rows of its run in " + journal_.path(), "none");
  }
  begin();
  return 0;
}

void ResultsFile::begin() {
  journal_.truncate(0);
  write_record(record_path(path_), record_);
  journal_.add(rows_header(format_));
  changed_ = true;
}

std::size_t ResultsFile::resume(const PairTable& table) {
  std::size_t rows = 0;
  bool header = format_ == RowFormat::csv;
  const std::size_t end = journal_.for_each_line([&](std::string_view line) {
    if (header) {
      if (std::string(line) + '\n' != rows_header(format_)) {
        refuse(journal_.path(), "the names of the columns", "another first line");
      }
      header = false;
      return;
    }
    const auto row = parse_row(line, format_);
    const bool expected =
        row && rows < table.pairs.size() && is_row_of(*row, rows, table.pairs[rows]);
    if (!expected) {
      refuse(journal_.path(), "rows of these pairs in their order",
             "another one as row " + std::to_string(rows));
    }
    ++statuses_[row->status];
    ++rows;
  });
  journal_.truncate(end);
  if (header) journal_.add(rows_header(format_));
  return rows;
}

void ResultsFile::add(const ResultRow& row) {
  journal_.add(row_line(row, format_));
  ++statuses_[row.status];
  changed_ = true;
}

void ResultsFile::finish(bool complete) {
  journal_.sync();
  if (parquet_ && complete && (changed_ || !std::filesystem::exists(path_))) write_parquet();
}

void ResultsFile::write_parquet() const {
  PartFile file(path_);
  ParquetWriter writer;
  file.write(writer.begin());
  std::vector<ResultRow> rows;
  const auto flush = [&] {
    if (!rows.empty()) file.write(writer.group(rows));
    rows.clear();
  };
  journal_.for_each_line([&](std::string_view line) {
    if (auto row = parse_row(line, format_)) rows.push_back(*std::move(row));
    if (rows.size() == rows_per_group) flush();
  });
  flush();
  file.write(writer.end(record_));
  file.finish();
}

}  // namespace vnreg::cli
