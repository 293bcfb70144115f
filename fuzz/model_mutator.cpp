// Mutates model files; repairs the sizes and checksums that it broke, so that what lies behind them
// is reached.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <span>

#include "model_format/crc32c.hpp"
#include "model_format/limits.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace vnreg::fuzz {
namespace {

using model_format::crc32c;

std::uint64_t load(const std::uint8_t* data, std::size_t byte) {
  std::uint64_t value = 0;
  std::memcpy(&value, data + byte, sizeof value);
  return value;
}

template <typename Number>
void store(std::uint8_t* data, std::size_t byte, Number value) {
  std::memcpy(data + byte, &value, sizeof value);
}

void repair_sizes(std::uint8_t* data, std::size_t size) {
  std::ranges::copy(model_format::magic, data);
  store(data, 8, model_format::major_version);
  store(data, 16, std::uint64_t{size});
  const std::uint64_t offset = std::min(load(data, 40) / 64 * 64, std::uint64_t{size} / 64 * 64);
  store(data, 40, offset);
  store(data, 48, size - offset);
}

void repair_checksums(std::uint8_t* data, std::size_t size) {
  const std::uint64_t offset = load(data, 40);
  if (offset < 64 || offset > size) return;
  const auto bytes = std::as_bytes(std::span(data, size));
  store(data, 56, crc32c(bytes.subspan(offset)));
  store(data, 60, crc32c(bytes.subspan(64, offset - 64), crc32c(bytes.first(60))));
}

}  // namespace
}  // namespace vnreg::fuzz

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  const std::size_t mutated = LLVMFuzzerMutate(data, size, max_size);
  // Now and then it stays as broken as it is, or its sizes stay wrong under right checksums.
  const unsigned repair = std::minstd_rand(seed)() % 16;
  if (mutated < 64 || repair == 0) return mutated;
  if (repair > 2) vnreg::fuzz::repair_sizes(data, mutated);
  vnreg::fuzz::repair_checksums(data, mutated);
  return mutated;
}
