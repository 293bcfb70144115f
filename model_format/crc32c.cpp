#include "model_format/crc32c.hpp"

#include <array>
#include <bit>
#include <cstring>

namespace vnreg::model_format {
namespace {

static_assert(std::endian::native == std::endian::little, "words are loaded as they lie in memory");

constexpr std::uint32_t reflected_polynomial = 0x82f63b78;  // 0x1edc6f41, lowest power first

// Slicing by eight: tables[s][b] is the effect of byte b followed by s zero bytes, so that eight
// bytes need eight independent look-ups instead of a chain of eight.
using Tables = std::array<std::array<std::uint32_t, 256>, 8>;

constexpr Tables make_tables() {
  Tables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t remainder = byte;
    for (int bit = 0; bit < 8; ++bit) {
      remainder = (remainder >> 1) ^ ((remainder & 1) != 0 ? reflected_polynomial : 0);
    }
    tables[0][byte] = remainder;
  }
  for (std::size_t slice = 1; slice < tables.size(); ++slice) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = tables[slice - 1][byte];
      tables[slice][byte] = (before >> 8) ^ tables[0][before & 0xff];
    }
  }
  return tables;
}

constexpr Tables tables = make_tables();

std::uint32_t advance_eight(std::uint32_t state, const std::byte* data) noexcept {
  std::uint64_t word = 0;
  std::memcpy(&word, data, sizeof word);
  word ^= state;
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < 8; ++i) next ^= tables[7 - i][(word >> (8 * i)) & 0xff];
  return next;
}

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t previous) noexcept {
  std::uint32_t state = ~previous;
  const std::size_t whole = bytes.size() - bytes.size() % 8;
  for (std::size_t i = 0; i < whole; i += 8) state = advance_eight(state, bytes.data() + i);
  for (const std::byte byte : bytes.subspan(whole)) {
    state = (state >> 8) ^ tables[0][(state ^ std::to_integer<std::uint32_t>(byte)) & 0xff];
  }
  return ~state;
}

}  // namespace vnreg::model_format
