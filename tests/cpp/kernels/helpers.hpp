// What the kernel tests share: random numbers, guarded buffers, tiles, normalised errors.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "kernels/packets.hpp"
#include "kernels/reference/vn.hpp"

namespace vnreg::kernels::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  float normal() { return normal_(engine_); }
  float uniform(float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(engine_);
  }
  Index integer(Index low, Index high) {
    return std::uniform_int_distribution<Index>(low, high)(engine_);
  }
  /// Weights that keep the scale of features with `in` channels.
  std::vector<float> weights(Index out, Index in) {
    std::vector<float> w(static_cast<std::size_t>(out * in));
    for (float& v : w) v = normal() / std::sqrt(static_cast<float>(in));
    return w;
  }
  std::vector<float> numbers(Index count) {
    std::vector<float> v(static_cast<std::size_t>(count));
    for (float& x : v) x = normal();
    return v;
  }
  reference::Vectors vectors(Index points, Index channels) {
    reference::Vectors v(points, channels);
    // Exactly representable in float32, so that both sides start from the same numbers.
    for (double& x : v.values) x = static_cast<double>(normal());
    return v;
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<float> normal_;
};

/// An output buffer between sentinels; the destructor of the test's scope is too late to fail, so
/// intact() is asked.
class GuardedFloats {
 public:
  explicit GuardedFloats(Index size)
      : size_(size), values_(static_cast<std::size_t>(size + 2 * guard), sentinel) {}

  float* data() { return values_.data() + guard; }
  const float* data() const { return values_.data() + guard; }
  bool intact() const {
    const auto is_sentinel = [](float v) { return v == sentinel; };
    return std::all_of(values_.begin(), values_.begin() + guard, is_sentinel) &&
           std::all_of(values_.begin() + guard + size_, values_.end(), is_sentinel);
  }

 private:
  static constexpr Index guard = 64;
  static constexpr float sentinel = -7.53e21f;
  Index size_;
  Floats values_;
};

/// One tile: rows padded, columns x | y | z.
inline Floats to_tile(const reference::Vectors& v) {
  const Index rows = padded(v.channels);
  Floats tile(static_cast<std::size_t>(rows * 3 * v.points), 0.0f);
  for (Index p = 0; p < v.points; ++p) {
    for (Index c = 0; c < v.channels; ++c) {
      for (Index axis = 0; axis < 3; ++axis) {
        tile[static_cast<std::size_t>((axis * v.points + p) * rows + c)] =
            static_cast<float>(v.at(p, c, axis));
      }
    }
  }
  return tile;
}

/// max |got - expected| / max |expected|; infinite if any number is not finite.
class NormalisedError {
 public:
  void add(double got, double expected) {
    if (!std::isfinite(got) || !std::isfinite(expected)) bad_ = true;
    difference_ = std::max(difference_, std::abs(got - expected));
    largest_ = std::max(largest_, std::abs(expected));
  }
  double value() const {
    if (bad_) return std::numeric_limits<double>::infinity();
    return largest_ > 0 ? difference_ / largest_ : difference_;
  }

 private:
  bool bad_ = false;
  double difference_ = 0;
  double largest_ = 0;
};

/// The error of a tile; padding rows must be exactly zero.
inline double tile_error(const float* tile, const reference::Vectors& expected) {
  const Index rows = padded(expected.channels);
  NormalisedError error;
  for (Index p = 0; p < expected.points; ++p) {
    for (Index axis = 0; axis < 3; ++axis) {
      const float* column = tile + (axis * expected.points + p) * rows;
      for (Index c = 0; c < rows; ++c) {
        const auto got = static_cast<double>(column[c]);
        if (c < expected.channels) {
          error.add(got, expected.at(p, c, axis));
        } else if (got != 0.0) {
          return std::numeric_limits<double>::infinity();
        }
      }
    }
  }
  return error.value();
}

}  // namespace vnreg::kernels::test
