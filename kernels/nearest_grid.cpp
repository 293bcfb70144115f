#include "kernels/nearest_grid.hpp"

#include <algorithm>
#include <cmath>

namespace vnreg::kernels {
namespace {

using Eigen::internal::pcmp_lt;
using Eigen::internal::ploadu;
using Eigen::internal::plset;
using Eigen::internal::pmadd;
using Eigen::internal::pselect;
using Eigen::internal::pset1;
using Eigen::internal::pstoreu;
using Eigen::internal::psub;

constexpr Index layers = NearestGrid::block;
constexpr Index most_cells = NearestGrid::cells;
// A packet may begin at the last cell of a row.
constexpr Index row_stride = most_cells + packet_size;
constexpr float no_point = -1.0f;
// Of cells and of distances: more than rounding.
constexpr float slack = 1e-3f;

/// The cells of an axis whose centres are within `reach` of a coordinate.
struct Range {
  Index first, last;

  /// `place` is the coordinate in cells from the first centre, `reach` in cells too.
  Range(float place, float reach, Index cells) noexcept
      : first(std::max<Index>(0, static_cast<Index>(std::ceil(place - reach - slack)))),
        last(std::min(cells - 1, static_cast<Index>(std::floor(place + reach + slack)))) {}
};

}  // namespace

/// The layers of a slab while points are offered to their cells. A cell keeps the nearest point
/// within the reach; of equally near ones, the first.
class NearestGrid::Slab {
 public:
  Slab(const NearestGrid& grid, Index first_layer) noexcept
      : grid_(grid), first_layer_(first_layer), reach_squared_(grid.reach_ * grid.reach_) {
    std::fill_n(&squared_[0][0][0], layers * most_cells * row_stride, reach_squared_ * (1 + slack));
    std::fill_n(&point_[0][0][0], layers * most_cells * row_stride, no_point);
  }

  /// The distance from the slab of what lies at z: squared, 0 inside.
  float distance_squared(float low, float high) const noexcept {
    const float first = grid_.centre(2, first_layer_);
    const float last = grid_.centre(2, first_layer_ + layers - 1);
    const float outside = std::max({first - high, low - last, 0.0f});
    return outside * outside;
  }
  bool reaches(float low, float high) const noexcept {
    return distance_squared(low, high) <= reach_squared_ * (1 + slack);
  }

  void offer(const float p[3], std::uint32_t number) noexcept {
    const float reach = grid_.reach_ * grid_.per_size_;
    const Range columns(grid_.place_of(0, p[0]), reach, grid_.counts_[0]);
    const Range rows(grid_.place_of(1, p[1]), reach, grid_.counts_[1]);
    for (Index layer = 0; layer < layers; ++layer) {
      const float dz = grid_.centre(2, first_layer_ + layer) - p[2];
      for (Index row = rows.first; row <= rows.last; ++row) {
        const float dy = grid_.centre(1, row) - p[1];
        const float across = dy * dy + dz * dz;
        if (across > reach_squared_ * (1 + slack)) continue;
        offer_row(p[0], across, static_cast<float>(number), columns, squared_[layer][row],
                  point_[layer][row]);
      }
    }
  }

  /// A place in the input of the index; negative where no point is within reach.
  const float* points(Index layer, Index row) const noexcept { return point_[layer][row]; }

 private:
  void offer_row(float x, float across, float number, const Range& columns, float* squared,
                 float* point) const noexcept {
    const Packet step = plset<Packet>(0.0f);
    for (Index i = columns.first; i <= columns.last; i += packet_size) {
      const Packet centre =
          pmadd(step, pset1<Packet>(grid_.size_), pset1<Packet>(grid_.centre(0, i)));
      const Packet dx = psub(centre, pset1<Packet>(x));
      const Packet distance = pmadd(dx, dx, pset1<Packet>(across));
      const Packet before = ploadu<Packet>(squared + i);
      const Packet nearer = pcmp_lt(distance, before);
      pstoreu(squared + i, pselect(nearer, distance, before));
      pstoreu(point + i, pselect(nearer, pset1<Packet>(number), ploadu<Packet>(point + i)));
    }
  }

  const NearestGrid& grid_;
  Index first_layer_;
  float reach_squared_;
  alignas(64) float squared_[layers][most_cells][row_stride];
  alignas(64) float point_[layers][most_cells][row_stride];  // exact: below 2^24
};

void NearestGrid::place(const SpatialIndex& index, float margin, float reach) noexcept {
  const Coordinates points = index.ordered();
  const float* coordinates[3] = {points.x, points.y, points.z};
  float sides[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::minmax_element(coordinates[axis], coordinates[axis] + index.count());
    low_[axis] = *low - margin;
    sides[axis] = (*high - *low) + 2 * margin;
  }
  size_ = std::max({sides[0], sides[1], sides[2]}) / static_cast<float>(cells);
  per_size_ = 1.0f / size_;
  for (int axis = 0; axis < 3; ++axis) {
    // The longest side may come out as 28.000002 cells.
    const auto needed = static_cast<Index>(std::ceil(sides[axis] * per_size_ - 1e-3f));
    const Index whole_blocks = (std::max<Index>(needed, 1) + block - 1) / block * block;
    counts_[axis] = std::min(whole_blocks, cells);
    last_[axis] = static_cast<float>(counts_[axis] - 1);
  }
  columns_ = static_cast<std::int32_t>(counts_[0]);
  rows_ = static_cast<std::int32_t>(counts_[1]);
  reach_ = reach;
}

void NearestGrid::fill(const SpatialIndex& index, Index slab, NeighbourScratch& scratch) noexcept {
  constexpr Index leaf_size = SpatialIndex::leaf_size;
  const Coordinates points = index.ordered();
  Slab held(*this, slab * block);
  for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
    const Box box = index.box(leaf);
    if (!held.reaches(box.low[2], box.high[2])) continue;
    const Index first = leaf * leaf_size;
    for (Index i = first; i < std::min(first + leaf_size, index.count()); ++i) {
      const float p[3] = {points.x[i], points.y[i], points.z[i]};
      if (held.reaches(p[2], p[2])) held.offer(p, index.original()[i]);
    }
  }
  store(index, held, slab * block, scratch);
}

/// Writes the points of the slab's cells; what no point reaches takes the point nearest to the
/// middle of its block.
void NearestGrid::store(const SpatialIndex& index, const Slab& slab, Index first_layer,
                        NeighbourScratch& scratch) noexcept {
  const Index blocks = counts_[0] / block;
  for (Index b = 0; b < blocks * counts_[1] / block; ++b) {
    const Index column = b % blocks * block, row = b / blocks * block;
    std::uint16_t far = 0;
    bool searched = false;
    for (Index i = 0; i < block * block * block; ++i) {
      const Index x = column + i % block, y = row + i / block % block, layer = i / (block * block);
      const float point = slab.points(layer, y)[x];
      if (point < 0 && !searched) {
        const float half = 0.5f * static_cast<float>(block - 1) * size_;
        const float middle[3] = {centre(0, column) + half, centre(1, row) + half,
                                 centre(2, first_layer) + half};
        nearest_places(index, {middle, middle + 1, middle + 2}, 1, scratch, &far);
        searched = true;
      }
      nearest_[static_cast<std::size_t>(((first_layer + layer) * counts_[1] + y) * counts_[0] +
                                        x)] = point < 0 ? far : static_cast<std::uint16_t>(point);
    }
  }
}

void NearestGrid::nearest(const Coordinates& queries, Index count,
                          std::uint16_t* places) const noexcept {
  constexpr Index most = 64;
  alignas(64) std::int32_t cell[most];
  for (Index first = 0; first < count; first += most) {
    const Index some = std::min(most, count - first);
    const float *x = queries.x + first, *y = queries.y + first, *z = queries.z + first;
#pragma omp simd
    for (Index i = 0; i < some; ++i) cell[i] = cell_of(x[i], y[i], z[i]);
    for (Index i = 0; i < some; ++i) {
      places[first + i] = nearest_[static_cast<std::size_t>(cell[i])];
    }
  }
}

}  // namespace vnreg::kernels
