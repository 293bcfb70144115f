#include <cstring>

#include "model_format/crc32c.hpp"
#include "model_format/limits.hpp"
#include "model_format/sections.hpp"

namespace vnreg::model_format {
namespace {

std::size_t begin_of(std::span<const std::byte> file, const Tensor& tensor) noexcept {
  return static_cast<std::size_t>(tensor.bytes.data() - file.data());
}

// NaN and infinity are the values whose exponent bits are all set. Looking at the bits keeps the
// check valid under any floating-point option of the compiler.
template <typename Bits>
bool is_finite(Bits bits, Bits exponent) noexcept {
  return (bits & exponent) != exponent;
}

template <typename Bits>
void check_finite(std::span<const std::byte> file, const Tensor& tensor, Bits exponent) {
  const std::size_t count = tensor.bytes.size() / sizeof(Bits);
  const auto bits_of = [&](std::size_t i) {
    Bits bits{};
    std::memcpy(&bits, tensor.bytes.data() + i * sizeof bits, sizeof bits);
    return bits;
  };
  bool all = true;  // no early exit, so that the loop is vectorised
  for (std::size_t i = 0; i < count; ++i) all &= is_finite(bits_of(i), exponent);
  if (all) return;
  std::size_t first = 0;
  while (is_finite(bits_of(first), exponent)) ++first;
  constexpr Bits sign = Bits{1} << (8 * sizeof(Bits) - 1);
  const bool infinite = (bits_of(first) & ~sign) == exponent;
  refuse("tensor \"" + tensor.name + "\" element " + std::to_string(first),
         begin_of(file, tensor) + first * sizeof(Bits), "a finite number",
         infinite ? "infinity" : "NaN");
}

void check_elements(std::span<const std::byte> file, const Tensor& tensor) {
  if (tensor.dtype == DType::f32) check_finite<std::uint32_t>(file, tensor, 0x7f800000);
  if (tensor.dtype == DType::f64) check_finite<std::uint64_t>(file, tensor, 0x7ff0000000000000);
}

}  // namespace

void check_zero(std::span<const std::byte> file, std::size_t begin, std::size_t end,
                const std::string& what) {
  for (std::size_t i = begin; i < end; ++i) {
    if (file[i] != std::byte{0})
      refuse(what, i, "0", std::to_string(std::to_integer<int>(file[i])));
  }
}

void check_data(std::span<const std::byte> file, const Header& header,
                const ModelFile::Tensors& tensors) {
  const std::uint32_t checksum = crc32c(file.subspan(header.data_offset));
  if (checksum != header.data_checksum) {
    refuse("data checksum", 56, std::to_string(checksum), std::to_string(header.data_checksum));
  }
  // In the order of the file: a tensor ends where its padding starts, the padding at the next
  // tensor.
  for (const auto& [name, tensor] : tensors) {
    const std::size_t end = begin_of(file, tensor) + tensor.bytes.size();
    check_elements(file, tensor);
    check_zero(file, end, rounded_up(end), "padding after tensor \"" + name + "\"");
  }
}

}  // namespace vnreg::model_format
