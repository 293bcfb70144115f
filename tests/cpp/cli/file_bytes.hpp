// Bytes of test files, points to fill them with, and the checks that every reader must pass.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "allocation_watch.hpp"
#include "cloud_file/cloud_file.hpp"

namespace vnreg::test {

using cloud_file::CloudFileError;
using cloud_file::parse_cloud;
using cloud_file::Points;

using Random = std::mt19937;

inline std::size_t pick(Random& random, std::size_t from, std::size_t to) {
  return std::uniform_int_distribution<std::size_t>(from, to)(random);
}

/// `value` as the bytes of a T in the given order.
template <class T>
std::string bytes_of(T value, std::endian order = std::endian::little) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (order != std::endian::native) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

/// Points whose coordinates are small whole numbers, so that every number type holds them exactly.
inline Points whole_points(Random& random, std::size_t count, int low = 0, int high = 100) {
  std::uniform_int_distribution<int> coordinate(low, high);
  Points points(count);
  for (auto& point : points) {
    for (double& value : point) value = coordinate(random);
  }
  return points;
}

/// `text` with every occurrence of `from` replaced.
inline std::string replaced(std::string_view text, std::string_view from, std::string_view to) {
  std::string result;
  for (std::size_t at = text.find(from); at != std::string_view::npos; at = text.find(from)) {
    result += text.substr(0, at);
    result += to;
    text.remove_prefix(at + from.size());
  }
  result += text;
  return result;
}

/// The text of the error that parsing gives; fails the test if it gives none or another exception.
inline std::string error_of(std::string_view bytes, std::string_view path) {
  try {
    parse_cloud(bytes, path);
  } catch (const CloudFileError& error) {
    return error.what();
  }
  FAIL("no error from " << path << " of " << bytes.size() << " bytes");
  return {};
}

/// Parses what may be broken: points or CloudFileError, nothing else, and no large allocation.
inline bool survives(std::string_view bytes, std::string_view path) {
  const AllocationWatch watch;
  bool parsed = true;
  try {
    parse_cloud(bytes, path);
  } catch (const CloudFileError& error) {
    parsed = false;
    REQUIRE(std::string_view(error.what()).find('\n') == std::string_view::npos);
  }
  REQUIRE(watch.largest() <= 1024 + 100 * bytes.size());
  return parsed;
}

/// Every proper prefix of a binary file must be refused.
inline void check_every_prefix_is_refused(std::string_view bytes, std::string_view path) {
  REQUIRE_NOTHROW(parse_cloud(bytes, path));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    INFO("prefix of " << size << " bytes of " << bytes.size());
    // A copy of its own, so that a sanitizer sees any access beyond the end.
    const std::vector<char> prefix(bytes.begin(),
                                   bytes.begin() + static_cast<std::ptrdiff_t>(size));
    CHECK_FALSE(survives({prefix.data(), prefix.size()}, path));
  }
}

/// Every prefix of a file of text must be read or refused.
inline void check_every_prefix_is_survived(std::string_view bytes, std::string_view path) {
  REQUIRE_NOTHROW(parse_cloud(bytes, path));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::vector<char> prefix(bytes.begin(),
                                   bytes.begin() + static_cast<std::ptrdiff_t>(size));
    survives({prefix.data(), prefix.size()}, path);
  }
}

/// Files with a few bytes changed, removed or doubled must be read or refused.
inline void check_mutants_are_survived(std::string_view bytes, std::string_view path, int count) {
  Random random(7);
  for (int i = 0; i < count; ++i) {
    std::string mutant(bytes);
    for (std::size_t edits = pick(random, 1, 4); edits > 0 && !mutant.empty(); --edits) {
      const std::size_t at = pick(random, 0, mutant.size() - 1);
      const auto byte = static_cast<char>(pick(random, 0, 255));
      switch (pick(random, 0, 3)) {
        case 0:
          mutant[at] = byte;
          break;
        case 1:
          mutant[at] = "0123456789 \n\r-e#,"[pick(random, 0, 16)];
          break;
        case 2:
          mutant.erase(at, pick(random, 1, 8));
          break;
        default:
          mutant.insert(at, mutant.substr(at, pick(random, 1, 8)));
      }
    }
    const std::vector<char> copy(mutant.begin(), mutant.end());
    survives({copy.data(), copy.size()}, path);
  }
}

inline void check_equal(const Points& points, const Points& expected) {
  REQUIRE(points.size() == expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    INFO("point " << i);
    REQUIRE(points[i] == expected[i]);
  }
}

}  // namespace vnreg::test
