// Points in an order in which near points are near in memory, in leaves of 16 with bounding boxes.
//
// Exact neighbour search then needs no tree: a query compares its bound with the boxes of all
// leaves (vectorised) and visits the few leaves that pass. The bound of a query comes from the
// query before it, its neighbour in the order, by the triangle inequality. All squared distances
// are (dx*dx + dy*dy) + dz*dz in float32, without fused operations; the box bound uses the same
// operations and rounding is monotone, so it never exceeds a distance in its leaf.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/packets.hpp"

namespace vnreg::kernels {

/// Coordinates as three arrays.
struct Coordinates {
  const float* x;
  const float* y;
  const float* z;
};

struct Box {
  float low[3];
  float high[3];
};

/// The smallest box around `count` >= 1 points.
Box box_of(const Coordinates& points, Index count) noexcept;

class SpatialIndex {
 public:
  static constexpr Index leaf_size = 16;
  /// Where padding lies: its square overflows to infinity, so it is beyond every finite bound.
  static constexpr float beyond = 1e30f;

  SpatialIndex() = default;
  /// Allocates for at most `max_points` points.
  explicit SpatialIndex(Index max_points);

  /// Orders `count` (1 to max_points) finite points with squares far below the largest float.
  void build(const Coordinates& points, Index count) noexcept {
    build(points, count, [] { return false; });
  }
  /// The same, asking about every half millisecond whether to stop; what is left then is no index.
  template <class Stop>
  void build(const Coordinates& points, Index count, const Stop& stop) noexcept {
    take(points, count);
    if (split(0, count, stop)) store();
  }
  /// The same from points that are in such an order already, as every so many of another index are;
  /// original()[i] becomes original[i].
  void build_ordered(const Coordinates& points, const std::uint32_t* original,
                     Index count) noexcept;

  Index count() const noexcept { return count_; }
  Index leaves() const noexcept { return (count_ + leaf_size - 1) / leaf_size; }
  /// The points in order; behind the last one, padding at an infinite distance from any point.
  Coordinates ordered() const noexcept { return {x_.data(), y_.data(), z_.data()}; }
  /// original()[i] is the place in the input of the i-th point of the order.
  const std::uint32_t* original() const noexcept { return original_.data(); }

  Box box(Index leaf) const noexcept;
  /// For each leaf: squared distances that no pair of a point of `box` and a point of the leaf
  /// falls below (nearest) or exceeds (farthest).
  void box_bounds(const Box& box, float* nearest, float* farthest) const noexcept;
  /// bounds[l] = a squared distance that no point of leaf l falls below, seen from (x, y, z).
  void leaf_bounds(float x, float y, float z, float* bounds) const noexcept;
  /// The squared distances from (x, y, z) to the 16 points of a leaf, infinite for padding.
  void leaf_distances(Index leaf, float x, float y, float z, float* squared) const noexcept;

 private:
  struct Item {
    float position[3];
    std::uint32_t original;
  };

  /// A piece of work between two questions.
  static constexpr Index points_at_once = 2048;

  void take(const Coordinates& points, Index count) noexcept;
  Index halve(Index first, Index last) noexcept;
  void split(Index first, Index last) noexcept;
  void store() noexcept;
  void finish() noexcept;
  void store_boxes() noexcept;

  /// False when it was stopped.
  template <class Stop>
  bool split(Index first, Index last, const Stop& stop) noexcept {
    if (last - first <= points_at_once) {
      split(first, last);
      return !stop();
    }
    const Index middle = halve(first, last);
    return !stop() && split(first, middle, stop) && split(middle, last, stop);
  }

  Index count_ = 0;
  std::vector<Item> items_;
  Floats x_, y_, z_;
  std::vector<std::uint32_t> original_;
  Floats low_[3], high_[3];
};

}  // namespace vnreg::kernels
