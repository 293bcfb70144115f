#include "kernels/spatial_index.hpp"

#include <algorithm>
#include <limits>

namespace vnreg::kernels {
namespace {

inline float squared_distance(float dx, float dy, float dz) noexcept {
  return (dx * dx + dy * dy) + dz * dz;
}

// Array expressions, because the compiler turns loops over comparisons with 0 into branches.
using Numbers = Eigen::Map<const Eigen::ArrayXf>;

Numbers view(const Floats& numbers, Index count) noexcept { return {numbers.data(), count}; }

/// How far q lies outside of each [low, high], 0 inside.
auto outside(float q, const Numbers& low, const Numbers& high) noexcept {
  return (low - q).max(q - high).max(0.0f);
}

/// How far [from, to] and each [low, high] are apart, 0 when they overlap.
auto gap(float from, float to, const Numbers& low, const Numbers& high) noexcept {
  return (low - to).max(from - high).max(0.0f);
}

/// The largest difference between a number of [from, to] and one of each [low, high].
auto span(float from, float to, const Numbers& low, const Numbers& high) noexcept {
  return (high - from).max(to - low);
}

}  // namespace

Box box_of(const Coordinates& points, Index count) noexcept {
  const float* coordinates[3] = {points.x, points.y, points.z};
  Box box;
  for (Index axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(coordinates[axis], coordinates[axis] + count);
    box.low[axis] = *low;
    box.high[axis] = *high;
  }
  return box;
}

SpatialIndex::SpatialIndex(Index max_points) {
  const auto leaves = static_cast<std::size_t>((max_points + leaf_size - 1) / leaf_size);
  const std::size_t points = leaves * static_cast<std::size_t>(leaf_size);
  items_.resize(points);
  original_.resize(points);
  for (Floats* array : {&x_, &y_, &z_}) array->resize(points);
  for (Index axis = 0; axis < 3; ++axis) {
    low_[axis].resize(leaves);
    high_[axis].resize(leaves);
  }
}

void SpatialIndex::take(const Coordinates& points, Index count) noexcept {
  count_ = count;
  for (Index i = 0; i < count; ++i) {
    items_[static_cast<std::size_t>(i)] = {{points.x[i], points.y[i], points.z[i]},
                                           static_cast<std::uint32_t>(i)};
  }
}

void SpatialIndex::store() noexcept {
  const Item* items = items_.data();
  for (Index i = 0; i < count_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    x_[at] = items[i].position[0];
    y_[at] = items[i].position[1];
    z_[at] = items[i].position[2];
    original_[at] = items[i].original;
  }
  finish();
}

void SpatialIndex::build_ordered(const Coordinates& points, const std::uint32_t* original,
                                 Index count) noexcept {
  count_ = count;
  std::copy_n(points.x, count, x_.begin());
  std::copy_n(points.y, count, y_.begin());
  std::copy_n(points.z, count, z_.begin());
  std::copy_n(original, count, original_.begin());
  finish();
}

/// Boxes, and the padding of the last leaf.
void SpatialIndex::finish() noexcept {
  store_boxes();
  for (auto i = static_cast<std::size_t>(count_);
       i < static_cast<std::size_t>(leaves() * leaf_size); ++i) {
    x_[i] = y_[i] = z_[i] = beyond;
    original_[i] = std::numeric_limits<std::uint32_t>::max();
  }
}

/// Halves [first, last) at a leaf boundary, which it returns, across the longest side of its box.
Index SpatialIndex::halve(Index first, Index last) noexcept {
  Item* items = items_.data();
  Index widest = 0;
  float widest_side = -1.0f;
  for (Index axis = 0; axis < 3; ++axis) {
    float low = items[first].position[axis];
    float high = low;
    for (Index i = first + 1; i < last; ++i) {
      low = std::min(low, items[i].position[axis]);
      high = std::max(high, items[i].position[axis]);
    }
    if (high - low > widest_side) {
      widest_side = high - low;
      widest = axis;
    }
  }
  const Index leaves = (last - first + leaf_size - 1) / leaf_size;
  const Index middle = first + (leaves + 1) / 2 * leaf_size;
  std::nth_element(
      items + first, items + middle, items + last,
      [widest](const Item& a, const Item& b) { return a.position[widest] < b.position[widest]; });
  return middle;
}

/// Halves [first, last) down to single leaves.
void SpatialIndex::split(Index first, Index last) noexcept {
  if (last - first <= leaf_size) return;
  const Index middle = halve(first, last);
  split(first, middle);
  split(middle, last);
}

void SpatialIndex::store_boxes() noexcept {
  for (Index leaf = 0; leaf < leaves(); ++leaf) {
    const Index first = leaf * leaf_size;
    const Box box = box_of({x_.data() + first, y_.data() + first, z_.data() + first},
                           std::min(leaf_size, count_ - first));
    for (Index axis = 0; axis < 3; ++axis) {
      low_[axis][static_cast<std::size_t>(leaf)] = box.low[axis];
      high_[axis][static_cast<std::size_t>(leaf)] = box.high[axis];
    }
  }
}

Box SpatialIndex::box(Index leaf) const noexcept {
  const auto at = static_cast<std::size_t>(leaf);
  return {{low_[0][at], low_[1][at], low_[2][at]}, {high_[0][at], high_[1][at], high_[2][at]}};
}

void SpatialIndex::box_bounds(const Box& box, float* nearest, float* farthest) const noexcept {
  const auto along = [&](std::size_t axis, auto measure) {
    return measure(box.low[axis], box.high[axis], view(low_[axis], leaves()),
                   view(high_[axis], leaves()));
  };
  const auto squares = [&](auto measure) {
    return (along(0, measure).square() + along(1, measure).square()) + along(2, measure).square();
  };
  Eigen::Map<Eigen::ArrayXf>(nearest, leaves()) =
      squares([](auto... interval) { return gap(interval...); });
  Eigen::Map<Eigen::ArrayXf>(farthest, leaves()) =
      squares([](auto... interval) { return span(interval...); });
}

void SpatialIndex::leaf_bounds(float x, float y, float z, float* bounds) const noexcept {
  const auto along = [&](std::size_t axis, float q) {
    return outside(q, view(low_[axis], leaves()), view(high_[axis], leaves())).square();
  };
  Eigen::Map<Eigen::ArrayXf>(bounds, leaves()) = (along(0, x) + along(1, y)) + along(2, z);
}

void SpatialIndex::leaf_distances(Index leaf, float x, float y, float z,
                                  float* squared) const noexcept {
  const float* px = x_.data() + leaf * leaf_size;
  const float* py = y_.data() + leaf * leaf_size;
  const float* pz = z_.data() + leaf * leaf_size;
#pragma omp simd
  for (Index i = 0; i < leaf_size; ++i) {
    squared[i] = squared_distance(px[i] - x, py[i] - y, pz[i] - z);
  }
}

}  // namespace vnreg::kernels
