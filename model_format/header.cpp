#include "model_format/header.hpp"

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

#include "model_format/crc32c.hpp"
#include "model_format/limits.hpp"
#include "model_format/refuse.hpp"

namespace vnreg::model_format {
namespace {

std::string text_of_bytes(std::span<const std::byte> bytes) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : bytes) {
    const auto value = std::to_integer<std::size_t>(byte);
    if (!text.empty()) text += ' ';
    text += digits[value >> 4];
    text += digits[value & 15];
  }
  return text.empty() ? "an empty file" : text;
}

void check_magic(std::span<const std::byte> file) {
  const auto wanted = std::as_bytes(std::span(magic));
  const auto found = file.first(std::min(file.size(), wanted.size()));
  if (std::ranges::equal(found, wanted)) return;
  std::string got = text_of_bytes(found);
  // The letters survive a transfer as text; the bytes around them are there to show it.
  if (found.size() >= 4 && std::ranges::equal(found.subspan(1, 3), wanted.subspan(1, 3))) {
    got += " (changed by a transfer as text? copy it as binary)";
  }
  throw Error(ErrorCode::not_a_model, "magic (byte 0)", text_of_bytes(wanted), std::move(got));
}

void check_version(std::uint32_t major, std::uint32_t minor) {
  if (major == major_version) return;
  throw Error(ErrorCode::unsupported_version, "major version (byte 8)",
              "version " + std::to_string(major_version) + "." + std::to_string(minor_version),
              "version " + std::to_string(major) + "." + std::to_string(minor));
}

// A number of the header; the caller has checked that `file` has one.
template <typename Number>
Number number_at(std::span<const std::byte> file, std::size_t byte) noexcept {
  Number value{};
  std::memcpy(&value, file.data() + byte, sizeof value);
  return value;
}

// A u64 of the header, small enough for the host and for what follows.
std::size_t size_at(std::span<const std::byte> file, std::size_t byte, std::string_view name,
                    std::uint64_t cap) {
  const auto value = number_at<std::uint64_t>(file, byte);
  if (value > cap) refuse(name, byte, "at most " + std::to_string(cap), std::to_string(value));
  return static_cast<std::size_t>(value);
}

void check_equal(std::string_view name, std::size_t byte, std::uint64_t got,
                 std::uint64_t expected) {
  if (got != expected) refuse(name, byte, std::to_string(expected), std::to_string(got));
}

void check_data_offset(const Header& header, std::size_t file_size) {
  const std::size_t first = header_bytes + header.metadata_bytes;
  const std::size_t offset = header.data_offset;
  if (offset % alignment == 0 && offset >= first && offset <= file_size) return;
  refuse("data offset", 40,
         "a multiple of " + std::to_string(alignment) + " from " + std::to_string(first) + " to " +
             std::to_string(file_size),
         std::to_string(offset));
}

void check_head_checksum(const Header& header, std::span<const std::byte> file) {
  const std::uint32_t before = crc32c(file.first(60));
  const auto rest = file.subspan(header_bytes, header.data_offset - header_bytes);
  check_equal("head checksum", 60, header.head_checksum, crc32c(rest, before));
}

}  // namespace

Header parse_header(std::span<const std::byte> file) {
  check_magic(file);
  if (file.size() < header_bytes) {
    refuse("header", 0, std::to_string(header_bytes) + " bytes",
           std::to_string(file.size()) + " bytes");
  }
  check_version(number_at<std::uint32_t>(file, 8), number_at<std::uint32_t>(file, 12));
  // The field is what the writer meant: a file of another size was cut or grew afterwards.
  check_equal("file size", 16, file.size(), size_at(file, 16, "file size", max_file_bytes));

  Header header{};
  header.metadata_bytes = size_at(file, 24, "metadata bytes", max_metadata_bytes);
  header.tensor_count = size_at(file, 32, "tensor count", max_tensors);
  header.data_offset = size_at(file, 40, "data offset", max_file_bytes);
  check_data_offset(header, file.size());
  header.data_bytes = size_at(file, 48, "data bytes", max_file_bytes);
  check_equal("data bytes", 48, header.data_bytes, file.size() - header.data_offset);
  header.data_checksum = number_at<std::uint32_t>(file, 56);
  header.head_checksum = number_at<std::uint32_t>(file, 60);
  check_head_checksum(header, file);
  return header;
}

}  // namespace vnreg::model_format
