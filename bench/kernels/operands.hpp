// Random operands of the micro-benchmarks.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "kernels/packets.hpp"
#include "kernels/spatial_index.hpp"

namespace vnreg::bench {

using kernels::Floats;
using kernels::Index;

/// Points per tile, as in the engine.
inline constexpr Index tile = 32;

inline Floats random_floats(Index count, std::uint64_t seed = 1) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  Floats values(static_cast<std::size_t>(count));
  for (float& v : values) v = 0.1f * normal(engine);
  return values;
}

inline Floats room(Index count) { return Floats(static_cast<std::size_t>(count), 0.0f); }

inline kernels::RowMajorMatrix random_matrix(Index rows, Index cols, std::uint64_t seed = 1) {
  const Floats values = random_floats(rows * cols, seed);
  return Eigen::Map<const kernels::RowMajorMatrix>(values.data(), rows, cols);
}

/// Points on the unit sphere: a surface, like the clouds of the engine.
struct Sphere {
  Floats x, y, z;

  explicit Sphere(Index count)
      : x(random_floats(count, 1)), y(random_floats(count, 2)), z(random_floats(count, 3)) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      const float norm = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
      x[i] /= norm;
      y[i] /= norm;
      z[i] /= norm;
    }
  }
  kernels::Coordinates coordinates() const { return {x.data(), y.data(), z.data()}; }
};

}  // namespace vnreg::bench
