// Reads little-endian fields one after the other and refuses to run over the end of a section.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

#include "model_format/refuse.hpp"

namespace vnreg::model_format {

class ByteCursor {
 public:
  /// Reads `file` from byte `begin` up to, not including, byte `end`. Host and file are
  /// little-endian (checked where the checksum is compiled).
  ByteCursor(std::span<const std::byte> file, std::size_t begin, std::size_t end) noexcept
      : file_(file), position_(begin), end_(end) {}

  std::size_t position() const noexcept { return position_; }
  bool at_end() const noexcept { return position_ == end_; }

  /// The next `count` bytes as the field `name`.
  std::span<const std::byte> take(std::uint64_t count, std::string_view name) {
    if (count > end_ - position_) {
      refuse(name, position_, std::to_string(count) + " bytes",
             std::to_string(end_ - position_) + " bytes to the end of the section");
    }
    const auto bytes = file_.subspan(position_, static_cast<std::size_t>(count));
    position_ += bytes.size();
    return bytes;
  }

  template <typename Number>
  Number number(std::string_view name) {
    Number value{};
    std::memcpy(&value, take(sizeof value, name).data(), sizeof value);
    return value;
  }

 private:
  std::span<const std::byte> file_;
  std::size_t position_;
  std::size_t end_;
};

}  // namespace vnreg::model_format
