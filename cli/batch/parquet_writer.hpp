// Rows of results as an Apache Parquet file: PLAIN values, no compression, one page a column and
// group. No library of Debian 12 writes the format; the subset here is that of the specification at
// https://github.com/apache/parquet-format (Encodings.md, parquet.thrift; version 2.10).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "batch/result_row.hpp"

namespace vnreg::cli {

/// Makes the bytes of one file, piece by piece: begin(), group() for some thousand rows at a time,
/// end(). Each returns what comes next in the file.
class ParquetWriter {
 public:
  /// The magic bytes.
  std::string begin();

  /// One row group. `rows` must not be empty.
  std::string group(std::span<const ResultRow> rows);

  /// The footer. `settings` is kept as the metadata "vnreg".
  std::string end(std::string_view settings) const;

 private:
  struct Chunk {
    std::int64_t offset;  // in the file
    std::int64_t bytes;
    std::int64_t values;
  };
  struct Group {
    std::vector<Chunk> chunks;  // one a column
    std::int64_t rows;
  };

  std::string group_metadata(const Group& group) const;

  std::vector<Group> groups_;
  std::int64_t offset_ = 0;
};

}  // namespace vnreg::cli
