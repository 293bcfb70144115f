// The first 64 bytes of a model file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace vnreg::model_format {

struct Header {
  std::size_t metadata_bytes;
  std::size_t tensor_count;
  std::size_t data_offset;
  std::size_t data_bytes;
  std::uint32_t data_checksum;
  std::uint32_t head_checksum;
};

/// Checks the ten fields of SPEC.md against each other, the size of `file` and the caps, then the
/// head checksum. Throws Error (not_a_model, unsupported_version, corrupt_model).
Header parse_header(std::span<const std::byte> file);

}  // namespace vnreg::model_format
