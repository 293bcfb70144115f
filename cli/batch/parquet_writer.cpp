#include "batch/parquet_writer.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "batch/thrift_compact.hpp"

namespace vnreg::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "the values are written as they lie");

constexpr std::string_view magic = "PAR1";

// The numbers of parquet.thrift.
enum PhysicalType : std::int32_t { type_int64 = 2, type_double = 5, type_byte_array = 6 };
enum Repetition : std::int32_t { required = 0, optional = 1, repeated = 2 };
enum ConvertedType : std::int32_t { converted_utf8 = 0, converted_list = 3 };
enum Encoding : std::int32_t { encoding_plain = 0, encoding_rle = 3 };
constexpr std::int32_t data_page = 0;
constexpr std::int32_t uncompressed = 0;

// ---- the kinds of columns ----

enum class Kind { whole, number, text, pose };

Kind kind_of(std::int64_t) { return Kind::whole; }
Kind kind_of(double) { return Kind::number; }
Kind kind_of(const std::string&) { return Kind::text; }
Kind kind_of(const std::optional<Pose>&) { return Kind::pose; }

struct Column {
  std::string name;
  Kind kind;
};

const std::vector<Column>& columns() {
  static const std::vector<Column> all = [] {
    std::vector<Column> list;
    const ResultRow row;
    for_each_column(row, [&](const char* name, const auto& field) {
      list.push_back({name, kind_of(field)});
    });
    return list;
  }();
  return all;
}

PhysicalType physical_type(Kind kind) {
  if (kind == Kind::whole) return type_int64;
  return kind == Kind::text ? type_byte_array : type_double;
}

// ---- the values of one column ----

/// Repetition or definition levels, at most 3, as runs of equal ones (Encodings.md, "RLE").
class Levels {
 public:
  void add(std::uint8_t level, std::uint64_t count = 1) {
    if (level != level_) end_run();
    level_ = level;
    run_ += count;
  }

  /// Their length in four bytes, then the runs.
  std::string finish() {
    end_run();
    const auto size = static_cast<std::uint32_t>(runs_.size());
    std::string bytes(sizeof(size), '\0');
    std::memcpy(bytes.data(), &size, sizeof(size));
    return bytes + runs_;
  }

 private:
  void end_run() {
    if (run_ == 0) return;
    append_varint(runs_, run_ << 1U);
    runs_ += static_cast<char>(level_);
    run_ = 0;
  }

  std::string runs_;
  std::uint64_t run_ = 0;
  std::uint8_t level_ = 0;
};

/// What a page of one column holds. A definition level tells how far down a value is there.
class ColumnValues {
 public:
  explicit ColumnValues(const Column& column) : column_(column) {}

  void add(std::int64_t value) {
    append(value);
    ++count_;
  }

  void add(double value) {
    const bool known = std::isfinite(value);
    define(known);
    if (known) append(value);
  }

  void add(const std::string& value) {
    const bool known = column_.name != "error" || !value.empty();
    define(known);
    if (!known) return;
    append(static_cast<std::uint32_t>(value.size()));
    values_ += value;
  }

  /// Levels: 0 no list, 2 an element of it; only its first element begins a new row.
  void add(const std::optional<Pose>& pose) {
    const std::uint64_t elements = pose ? pose->size() : 1;
    repetition_.add(0);
    if (elements > 1) repetition_.add(1, elements - 1);
    definition_.add(pose ? 2 : 0, elements);
    count_ += static_cast<std::int64_t>(elements);
    if (!pose) return;
    for (const double value : *pose) append(value);
  }

  std::int64_t count() const { return count_; }

  /// The page with its header.
  std::string page() {
    std::string body;
    if (column_.kind == Kind::pose) body += repetition_.finish();
    if (column_.kind != Kind::whole) body += definition_.finish();
    body += values_;
    ThriftStruct data_header;
    data_header.i32(1, static_cast<std::int32_t>(count_));
    data_header.i32(2, encoding_plain);
    data_header.i32(3, encoding_rle);
    data_header.i32(4, encoding_rle);
    ThriftStruct header;
    header.i32(1, data_page);
    header.i32(2, static_cast<std::int32_t>(body.size()));
    header.i32(3, static_cast<std::int32_t>(body.size()));
    header.structure(5, data_header.finish());
    return header.finish() + body;
  }

 private:
  void define(bool known) {
    definition_.add(known ? 1 : 0);
    ++count_;
  }

  template <class T>
  void append(T value) {
    char bytes[sizeof(value)];
    std::memcpy(bytes, &value, sizeof(value));
    values_.append(bytes, sizeof(value));
  }

  const Column& column_;
  Levels repetition_;
  Levels definition_;
  std::string values_;
  std::int64_t count_ = 0;
};

// ---- the schema ----

std::string inner_node(const std::string& name, std::optional<Repetition> repetition,
                       std::int32_t children, std::optional<ConvertedType> converted) {
  ThriftStruct node;
  if (repetition) node.i32(3, *repetition);
  node.text(4, name);
  node.i32(5, children);
  if (converted) node.i32(6, *converted);
  return node.finish();
}

std::string leaf(const std::string& name, Kind kind, Repetition repetition) {
  ThriftStruct node;
  node.i32(1, physical_type(kind));
  node.i32(3, repetition);
  node.text(4, name);
  if (kind == Kind::text) node.i32(6, converted_utf8);
  return node.finish();
}

std::vector<std::string> schema() {
  const auto count = static_cast<std::int32_t>(columns().size());
  std::vector<std::string> nodes{inner_node("schema", std::nullopt, count, std::nullopt)};
  for (const Column& column : columns()) {
    if (column.kind == Kind::pose) {
      nodes.push_back(inner_node(column.name, optional, 1, converted_list));
      nodes.push_back(inner_node("list", repeated, 1, std::nullopt));
      nodes.push_back(leaf("element", Kind::number, required));
    } else {
      nodes.push_back(
          leaf(column.name, column.kind, column.kind == Kind::whole ? required : optional));
    }
  }
  return nodes;
}

std::vector<std::string> path_in_schema(const Column& column) {
  if (column.kind == Kind::pose) return {column.name, "list", "element"};
  return {column.name};
}

}  // namespace

std::string ParquetWriter::begin() {
  offset_ = static_cast<std::int64_t>(magic.size());
  return std::string(magic);
}

std::string ParquetWriter::group(std::span<const ResultRow> rows) {
  std::vector<ColumnValues> values(columns().begin(), columns().end());
  for (const ResultRow& row : rows) {
    std::size_t column = 0;
    for_each_column(row, [&](const char*, const auto& field) { values[column++].add(field); });
  }
  Group group{{}, static_cast<std::int64_t>(rows.size())};
  std::string bytes;
  for (ColumnValues& column : values) {
    const std::string page = column.page();
    const auto size = static_cast<std::int64_t>(page.size());
    group.chunks.push_back({offset_, size, column.count()});
    offset_ += size;
    bytes += page;
  }
  groups_.push_back(std::move(group));
  return bytes;
}

std::string ParquetWriter::group_metadata(const Group& group) const {
  static constexpr std::int32_t encodings[] = {encoding_plain, encoding_rle};
  std::vector<std::string> chunks;
  std::int64_t bytes = 0;
  for (std::size_t i = 0; i < columns().size(); ++i) {
    const Chunk& chunk = group.chunks[i];
    ThriftStruct metadata;
    metadata.i32(1, physical_type(columns()[i].kind));
    metadata.i32_list(2, encodings);
    metadata.text_list(3, path_in_schema(columns()[i]));
    metadata.i32(4, uncompressed);
    metadata.i64(5, chunk.values);
    metadata.i64(6, chunk.bytes);
    metadata.i64(7, chunk.bytes);
    metadata.i64(9, chunk.offset);
    ThriftStruct column;
    column.i64(2, chunk.offset);
    column.structure(3, metadata.finish());
    chunks.push_back(column.finish());
    bytes += chunk.bytes;
  }
  ThriftStruct metadata;
  metadata.structure_list(1, chunks);
  metadata.i64(2, bytes);
  metadata.i64(3, group.rows);
  return metadata.finish();
}

std::string ParquetWriter::end(std::string_view settings) const {
  std::vector<std::string> groups;
  std::int64_t rows = 0;
  for (const Group& group : groups_) {
    groups.push_back(group_metadata(group));
    rows += group.rows;
  }
  ThriftStruct key_value;
  key_value.text(1, "vnreg");
  key_value.text(2, settings);
  const std::string metadata[] = {key_value.finish()};
  ThriftStruct footer;
  footer.i32(1, 1);  // version of the format
  footer.structure_list(2, schema());
  footer.i64(3, rows);
  footer.structure_list(4, groups);
  footer.structure_list(5, metadata);
  footer.text(6, "vnreg version " + std::string(version()));
  std::string bytes = footer.finish();
  const auto size = static_cast<std::uint32_t>(bytes.size());
  char length[sizeof(size)];
  std::memcpy(length, &size, sizeof(size));
  return bytes.append(length, sizeof(size)).append(magic);
}

}  // namespace vnreg::cli
