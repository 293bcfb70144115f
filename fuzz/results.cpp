// Any bytes as what an earlier run of `vnreg batch` left: its rows or the record of its settings.
// The first byte says which: c, j and p are rows of the three formats, r is a record.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <string>

#include "batch/results_file.hpp"
#include "batch/run_record.hpp"
#include "command.hpp"
#include "messages.hpp"
#include "temporary_folder.hpp"

namespace vnreg::fuzz {
namespace {

using cli::CommandError;
using cli::ResultRow;
using cli::ResultsFile;
using cli::RowFormat;

const cli::PairTable table{{{"0", "a.ply", "b.ply"}, {"x, \"y\"", "c d.npy", "\xff.ply"}}, ""};

void write(const std::string& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string record() {
  static const std::string text = cli::run_record({}, Model::builtin());
  return text;
}

ResultRow row_of(std::size_t number) {
  ResultRow row;
  row.row = static_cast<std::int64_t>(number);
  row.id = number == 0 ? "0" : R"(x, "y")";
  row.source = number == 0 ? "a.ply" : "c d.npy";
  row.target = number == 0 ? "b.ply" : R"(\xff.ply)";
  return row;
}

/// What lies in the folder: the results under their name, and what holds their rows.
struct Files {
  std::string results;
  std::string journal;
  RowFormat format;
};

Files files_in(const test::TemporaryFolder& folder, char kind) {
  if (kind == 'c') return {folder / "a.csv", folder / "a.csv", RowFormat::csv};
  if (kind == 'p') {
    return {folder / "a.parquet", folder / "a.parquet.rows.jsonl", RowFormat::jsonl};
  }
  return {folder / "a.jsonl", folder / "a.jsonl", RowFormat::jsonl};
}

/// Goes on with the rows that are there; returns how many those were.
std::size_t run(const Files& files) {
  ResultsFile results(files.results);
  const std::size_t done = results.begin_or_resume(table, record(), false);
  require(done <= table.pairs.size(), "no more rows than pairs");
  for (std::size_t i = done; i < table.pairs.size(); ++i) results.add(row_of(i));
  results.finish(true);
  const auto& statuses = results.statuses();
  require(table.pairs.size() == std::accumulate(statuses.begin(), statuses.end(), std::size_t{0},
                                                [](std::size_t sum, const auto& status) {
                                                  return sum + status.second;
                                                }),
          "every row has a status");
  return done;
}

/// The first rows are those that were there, and no line is anything but a row.
void check_rows(const Files& files, std::string_view before) {
  const std::string after = read(files.journal);
  const std::size_t last_end = before.rfind('\n');
  const std::string_view kept = before.substr(0, last_end == before.npos ? 0 : last_end + 1);
  require(after.starts_with(kept), "what was done is kept");
  std::string_view rest = after;
  const std::string header = cli::rows_header(files.format);
  require(rest.starts_with(header), "the columns have their names");
  rest.remove_prefix(header.size());
  for (std::size_t i = 0; i < table.pairs.size(); ++i) {
    const std::size_t size = rest.find('\n');
    require(size != rest.npos, "every pair has its row");
    require(cli::parse_row(rest.substr(0, size), files.format).has_value(), "a row can be read");
    rest.remove_prefix(size + 1);
  }
  require(rest.empty(), "nothing follows the rows");
}

void check_parquet(const std::string& path) {
  const std::string bytes = read(path);
  require(bytes.size() > 12 && bytes.starts_with("PAR1") && bytes.ends_with("PAR1"),
          "a whole Parquet file was made");
}

void go_on(const Files& files, std::string_view rows) {
  try {
    run(files);
  } catch (const CommandError& error) {
    check_message(error.what());
    require(error.code() == cli::ExitCode::usage, "the machine is well");
    require(read(files.journal) == rows, "a file that is refused stays as it is");
    return;
  }
  check_rows(files, rows);
  if (files.results != files.journal) check_parquet(files.results);
  require(run(files) == table.pairs.size(), "there is nothing left to do");
}

void read_what_is_left(char kind, std::string_view bytes) {
  static const test::TemporaryFolder folder;  // every input makes files in it
  const Files files = files_in(folder, kind);
  std::filesystem::remove(files.results);
  const bool is_record = kind == 'r';
  const std::string rows = is_record ? cli::row_line(row_of(0), files.format) : std::string(bytes);
  write(files.journal, rows);
  write(cli::record_path(files.results), is_record ? bytes : std::string_view(record()));
  go_on(files, rows);
}

}  // namespace
}  // namespace vnreg::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  vnreg::fuzz::read_what_is_left(bytes.front(), bytes.substr(1));
  return 0;
}
