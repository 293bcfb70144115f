#include "model_format/limits.hpp"
#include "model_format/sections.hpp"

namespace vnreg::model_format {
namespace {

DType parse_dtype(ByteCursor& cursor, const std::string& what) {
  const std::size_t byte = cursor.position();
  const auto code = cursor.number<std::uint32_t>(what);
  if (code < 1 || code > 3) refuse(what, byte, "1 (f32), 2 (f64) or 3 (i32)", std::to_string(code));
  return static_cast<DType>(code);
}

std::uint64_t element_bytes(DType dtype) noexcept { return dtype == DType::f64 ? 8 : 4; }

// The one place where sizes from the file are multiplied: count * extent, both of them at least 1
// and the product at most the size of a file.
std::uint64_t checked_product(std::uint64_t count, std::uint64_t extent, const std::string& what,
                              std::size_t byte) {
  if (extent < 1 || extent > max_file_bytes / count) {
    refuse(what, byte, "1 to " + std::to_string(max_file_bytes / count), std::to_string(extent));
  }
  return count * extent;
}

std::vector<std::size_t> parse_shape(ByteCursor& cursor, const std::string& what, DType dtype,
                                     std::uint64_t& bytes) {
  const std::size_t rank_byte = cursor.position();
  const auto rank = cursor.number<std::uint32_t>(what + " rank");
  if (rank < 1 || rank > max_rank) {
    refuse(what + " rank", rank_byte, "1 to " + std::to_string(max_rank), std::to_string(rank));
  }
  std::vector<std::size_t> shape;
  shape.reserve(rank);
  bytes = element_bytes(dtype);
  for (std::uint32_t axis = 0; axis < rank; ++axis) {
    const std::string field = what + " extent of axis " + std::to_string(axis);
    const std::size_t byte = cursor.position();
    const auto extent = cursor.number<std::uint64_t>(field);
    bytes = checked_product(bytes, extent, field, byte);
    shape.push_back(static_cast<std::size_t>(extent));
  }
  return shape;
}

// Reads one entry; `next_offset` is the running sum of the padded sizes.
Tensor parse_tensor(ByteCursor& cursor, std::span<const std::byte> data, std::string name,
                    std::uint64_t& next_offset) {
  Tensor tensor;
  const std::string what = "tensor \"" + name + "\"";
  tensor.name = std::move(name);
  tensor.dtype = parse_dtype(cursor, what + " dtype");
  std::uint64_t bytes = 0;
  tensor.shape = parse_shape(cursor, what, tensor.dtype, bytes);
  const std::size_t offset_byte = cursor.position();
  const auto offset = cursor.number<std::uint64_t>(what + " offset");
  if (offset != next_offset) {
    refuse(what + " offset", offset_byte, std::to_string(next_offset), std::to_string(offset));
  }
  if (rounded_up(bytes) > data.size() - offset) {
    refuse(what + " padded size", offset_byte,
           "at most " + std::to_string(data.size() - offset) + " bytes of data",
           std::to_string(rounded_up(bytes)));
  }
  tensor.bytes = data.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(bytes));
  next_offset += rounded_up(bytes);
  return tensor;
}

void check_table_end(std::span<const std::byte> file, const Header& header, std::size_t end) {
  if (rounded_up(end) != header.data_offset) {
    refuse("data offset", 40, std::to_string(rounded_up(end)), std::to_string(header.data_offset));
  }
  check_zero(file, end, header.data_offset, "padding after the tensor table");
}

}  // namespace

ModelFile::Tensors parse_tensor_table(std::span<const std::byte> file, const Header& header) {
  ModelFile::Tensors tensors;
  const auto data = file.subspan(header.data_offset);
  std::string_view previous;
  std::uint64_t next_offset = 0;
  ByteCursor cursor(file, header_bytes + header.metadata_bytes, header.data_offset);
  for (std::size_t i = 0; i < header.tensor_count; ++i) {
    previous = parse_name(cursor, "name of tensor " + std::to_string(i), previous);
    const std::string name(previous);
    tensors.emplace_hint(tensors.end(), name, parse_tensor(cursor, data, name, next_offset));
  }
  check_table_end(file, header, cursor.position());
  if (next_offset != header.data_bytes) {
    refuse("data bytes", 48, std::to_string(next_offset), std::to_string(header.data_bytes));
  }
  return tensors;
}

}  // namespace vnreg::model_format
