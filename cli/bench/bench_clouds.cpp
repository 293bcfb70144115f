#include "bench/bench_clouds.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include "rotation.hpp"

namespace vnreg::cli {
namespace {

using Point = std::array<double, 3>;

/// Numbers that are the same with every standard library, unlike those of its distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}

  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(bits_() >> 11U) * 0x1p-53;
  }

  double normal(double deviation) {
    const double radius = std::sqrt(-2 * std::log(between(0x1p-53, 1)));
    return deviation * radius * std::cos(between(0, 2 * std::numbers::pi));
  }

 private:
  std::mt19937_64 bits_;
};

Point tube_point(Random& random) {
  const double along = random.between(-1, 1);
  const double around = random.between(0, 2 * std::numbers::pi);
  const double radius = 0.25 + 0.15 * along;
  return {along, 0.4 * along * along + radius * std::cos(around),
          0.2 * along + radius * std::sin(around)};
}

Point fin_point(Random& random) { return {random.between(0.2, 0.8), random.between(0.3, 1.1), 0}; }

/// Row-major, by Rodrigues' formula.
constexpr double turn_angle = 2;
constexpr Point turn_axis{1.0 / 3, 2.0 / 3, 2.0 / 3};

Pose turn_pose() {
  const auto [x, y, z] = turn_axis;
  const double c = std::cos(turn_angle);
  const double s = std::sin(turn_angle);
  const double v = 1 - c;
  return {v * x * x + c,
          v * x * y - s * z,
          v * x * z + s * y,
          0.3,
          v * x * y + s * z,
          v * y * y + c,
          v * y * z - s * x,
          -0.2,
          v * x * z - s * y,
          v * y * z + s * x,
          v * z * z + c,
          0.5,
          0,
          0,
          0,
          1};
}

}  // namespace

cloud_file::Points bench_cloud(int count, std::uint64_t seed) {
  Random random(seed);
  cloud_file::Points points;
  for (int i = 0; i < count; ++i) {
    Point point = i % 4 == 3 ? fin_point(random) : tube_point(random);
    for (double& value : point) value += random.normal(0.005);
    points.push_back(point);
  }
  return points;
}

cloud_file::Points turned(const cloud_file::Points& points) {
  const Pose pose = turn_pose();
  cloud_file::Points moved;
  for (const Point& point : points) moved.push_back(transform(pose, point));
  return moved;
}

}  // namespace vnreg::cli
