#include "cloud_file/scalar_type.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

namespace vnreg::cloud_file {
namespace {

template <class T>
double load(const char* bytes, std::endian order) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (order != std::endian::native) std::reverse(raw.begin(), raw.end());
  return static_cast<double>(std::bit_cast<T>(raw));
}

}  // namespace

std::size_t size_of(ScalarType type) {
  switch (type) {
    case ScalarType::int8:
    case ScalarType::uint8:
      return 1;
    case ScalarType::int16:
    case ScalarType::uint16:
      return 2;
    case ScalarType::int32:
    case ScalarType::uint32:
    case ScalarType::float32:
      return 4;
    case ScalarType::int64:
    case ScalarType::uint64:
    case ScalarType::float64:
      break;
  }
  return 8;
}

bool is_integer(ScalarType type) {
  return type != ScalarType::float32 && type != ScalarType::float64;
}

double load_scalar(const char* bytes, ScalarType type, std::endian order) {
  switch (type) {
    case ScalarType::int8:
      return load<std::int8_t>(bytes, order);
    case ScalarType::uint8:
      return load<std::uint8_t>(bytes, order);
    case ScalarType::int16:
      return load<std::int16_t>(bytes, order);
    case ScalarType::uint16:
      return load<std::uint16_t>(bytes, order);
    case ScalarType::int32:
      return load<std::int32_t>(bytes, order);
    case ScalarType::uint32:
      return load<std::uint32_t>(bytes, order);
    case ScalarType::int64:
      return load<std::int64_t>(bytes, order);
    case ScalarType::uint64:
      return load<std::uint64_t>(bytes, order);
    case ScalarType::float32:
      return load<float>(bytes, order);
    case ScalarType::float64:
      break;
  }
  return load<double>(bytes, order);
}

}  // namespace vnreg::cloud_file
