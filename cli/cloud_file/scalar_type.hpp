// Numbers of binary files: their types, sizes and byte orders.
#pragma once

#include <bit>
#include <cstddef>

namespace vnreg::cloud_file {

enum class ScalarType {
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64
};

/// Bytes of one number: 1, 2, 4 or 8.
std::size_t size_of(ScalarType type);

/// True for the signed and unsigned integers.
bool is_integer(ScalarType type);

/// The number at `bytes`, which must hold size_of(type) bytes and need not be aligned. 64-bit
/// integers are rounded to the nearest double.
double load_scalar(const char* bytes, ScalarType type, std::endian order);

}  // namespace vnreg::cloud_file
