// The pairs that a batch aligns: a table of files, as CSV.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace vnreg::cli {

/// One row of the table.
struct Pair {
  std::string id;      // column `id`; without one, the number of the row from 0
  std::string source;  // as written in the table
  std::string target;
};

struct PairTable {
  std::vector<Pair> pairs;
  std::string folder;  // what relative names are relative to; empty: the current folder

  /// Where the file `name` of the table lies.
  std::string path_of(const std::string& name) const;
};

/// Reads the CSV `bytes`. A first row with fields called `source` and `target` says which columns
/// they are, and which is `id`; without it the first two columns are source and target. Other
/// columns and blank lines are skipped. Throws CloudFileError with the number of the line.
std::vector<Pair> parse_pairs(std::string_view bytes);

/// Reads the table at `path`, or standard input for "-". Names in it are relative to its folder.
/// Throws CommandError.
PairTable read_pairs(const std::string& path);

}  // namespace vnreg::cli
