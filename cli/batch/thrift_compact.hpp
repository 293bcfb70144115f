// The compact protocol of Apache Thrift, as far as Parquet's headers need it
// (thrift/doc/specs/thrift-compact-protocol.md).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace vnreg::cli {

/// Appends `value` in base 128, the lowest seven bits first.
void append_varint(std::string& bytes, std::uint64_t value);

/// Writes one struct, field by field; the numbers of the fields must rise.
class ThriftStruct {
 public:
  void i32(int field, std::int32_t value);
  void i64(int field, std::int64_t value);
  void text(int field, std::string_view value);
  void structure(int field, const std::string& finished);
  void i32_list(int field, std::span<const std::int32_t> values);
  void text_list(int field, std::span<const std::string> values);
  void structure_list(int field, std::span<const std::string> finished);

  /// The bytes of the whole struct.
  std::string finish() const { return bytes_ + '\0'; }

 private:
  enum class Type : std::uint8_t { i32 = 5, i64 = 6, binary = 8, list = 9, structure = 12 };

  void begin_field(int field, Type type);
  void begin_list(int field, std::size_t size, Type element);

  std::string bytes_;
  int last_field_ = 0;
};

}  // namespace vnreg::cli
