#include "batch/thrift_compact.hpp"

namespace vnreg::cli {
namespace {

void append_zigzag(std::string& bytes, std::int64_t value) {
  const auto bits = static_cast<std::uint64_t>(value);
  append_varint(bytes, (bits << 1U) ^ (value < 0 ? ~std::uint64_t{0} : 0));
}

void append_text(std::string& bytes, std::string_view text) {
  append_varint(bytes, text.size());
  bytes += text;
}

}  // namespace

void append_varint(std::string& bytes, std::uint64_t value) {
  for (; value >= 128; value >>= 7U) bytes += static_cast<char>(value | 128U);
  bytes += static_cast<char>(value);
}

void ThriftStruct::begin_field(int field, Type type) {
  // The fields of Parquet's structs lie less than 16 apart.
  bytes_ += static_cast<char>((field - last_field_) << 4 | static_cast<int>(type));
  last_field_ = field;
}

void ThriftStruct::begin_list(int field, std::size_t size, Type element) {
  begin_field(field, Type::list);
  const auto type = static_cast<unsigned>(element);
  if (size < 15) {
    bytes_ += static_cast<char>(size << 4U | type);
  } else {
    bytes_ += static_cast<char>(0xF0U | type);
    append_varint(bytes_, size);
  }
}

void ThriftStruct::i32(int field, std::int32_t value) {
  begin_field(field, Type::i32);
  append_zigzag(bytes_, value);
}

void ThriftStruct::i64(int field, std::int64_t value) {
  begin_field(field, Type::i64);
  append_zigzag(bytes_, value);
}

void ThriftStruct::text(int field, std::string_view value) {
  begin_field(field, Type::binary);
  append_text(bytes_, value);
}

void ThriftStruct::structure(int field, const std::string& finished) {
  begin_field(field, Type::structure);
  bytes_ += finished;
}

void ThriftStruct::i32_list(int field, std::span<const std::int32_t> values) {
  begin_list(field, values.size(), Type::i32);
  for (const std::int32_t value : values) append_zigzag(bytes_, value);
}

void ThriftStruct::text_list(int field, std::span<const std::string> values) {
  begin_list(field, values.size(), Type::binary);
  for (const std::string& value : values) append_text(bytes_, value);
}

void ThriftStruct::structure_list(int field, std::span<const std::string> finished) {
  begin_list(field, finished.size(), Type::structure);
  for (const std::string& bytes : finished) bytes_ += bytes;
}

}  // namespace vnreg::cli
