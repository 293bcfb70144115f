#include <cstdint>

#include "model_format/limits.hpp"
#include "model_format/model_file.hpp"
#include "model_format/sections.hpp"

namespace vnreg::model_format {

ModelFile ModelFile::parse(std::span<const std::byte> bytes) {
  // Tensors are handed out as spans of float and double, and kernels like them on cache lines.
  const auto misaligned = reinterpret_cast<std::uintptr_t>(bytes.data()) % alignment;
  if (misaligned != 0) {
    throw Error(ErrorCode::invalid_option, "address of the model's bytes",
                "a multiple of " + std::to_string(alignment),
                std::to_string(misaligned) + " bytes more than one");
  }
  ModelFile model;
  const Header header = parse_header(bytes);
  model.checksum_ = header.head_checksum;
  model.metadata_ = parse_metadata(bytes, header);
  model.tensors_ = parse_tensor_table(bytes, header);
  check_data(bytes, header, model.tensors_);
  return model;
}

}  // namespace vnreg::model_format
