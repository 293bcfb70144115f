#include "engine/neighbourhood.hpp"

#include <algorithm>

namespace vnreg::detail {
namespace {

constexpr Index leaves_per_task = 16;

/// Network `vnreg` takes moments for neighbourhoods: only the spacing is left to find.
void search_neighbours(const ModelData& model, Workspace& w) noexcept {
  const bool spacing_only = model.descriptor_model.has_value();
  const auto tasks = [&](Index side) {
    return (w.cloud[side].index.leaves() + leaves_per_task - 1) / leaves_per_task;
  };
  parallel_for_parts(w.threads, w.sides, tasks, [&](Index side, Index task, int thread) {
    Cloud& cloud = w.cloud[side];
    kernels::NeighbourScratch& scratch = w.scratch[static_cast<std::size_t>(thread)].neighbours;
    const Index first = task * leaves_per_task;
    const Index last = std::min(first + leaves_per_task, cloud.index.leaves());
    if (spacing_only) {
      kernels::nearest_others(cloud.index, first, last, scratch, cloud.spacing_squared.data());
    } else {
      kernels::mean_neighbour_offsets(cloud.index, model.arch.neighbours, first, last, scratch,
                                      cloud.offset_x.data(), cloud.offset_y.data(),
                                      cloud.offset_z.data(), cloud.spacing_squared.data());
    }
  });
}

/// Column order within a tile: x of all points, y of all, z of all; three vectors per column.
void write_edges(const Cloud& cloud, Index tile, float* edges) noexcept {
  const Index first = tile * tile_points;
  const Index width = std::min(tile_points, cloud.count - first);
  float* ex = edges + 9 * first;
  float* ey = ex + 3 * width;
  float* ez = ey + 3 * width;
  for (Index p = first; p < first + width; ++p, ex += 3, ey += 3, ez += 3) {
    const float x = cloud.x[p], y = cloud.y[p], z = cloud.z[p];
    const float dx = cloud.offset_x[p], dy = cloud.offset_y[p], dz = cloud.offset_z[p];
    ex[0] = dx;
    ey[0] = dy;
    ez[0] = dz;
    ex[1] = x;
    ey[1] = y;
    ez[1] = z;
    // mean_j(x_j) x x_i = (mean_j(x_j) - x_i) x x_i, without the cancellation.
    ex[2] = dy * z - dz * y;
    ey[2] = dz * x - dx * z;
    ez[2] = dx * y - dy * x;
  }
}

}  // namespace

void find_neighbourhoods(const ModelData& model, Workspace& w) noexcept {
  parallel_for_parts(
      w.threads, w.sides, [](Index) { return 1; },
      [&](Index side, Index, int) {
        Cloud& cloud = w.cloud[side];
        cloud.index.build(cloud.coordinates(), cloud.count, [&] { return w.deadline.passed(); });
      });
  search_neighbours(model, w);
  for (const Index side : w.sides) {
    const Cloud& cloud = w.cloud[side];
    w.recorder.coordinates(side_name(side), "points", cloud.coordinates(), cloud.count);
  }
}

void find_edges(Workspace& w) noexcept {
  w.for_each_tile([&](Index side, Index tile, ThreadScratch&) {
    write_edges(w.cloud[side], tile, w.features[side].edges.data());
  });
  for (const Index side : w.sides) {
    w.recorder.vectors(side_name(side), "edge", w.features[side].edges.data(), 3, 3,
                       w.cloud[side].count, tile_points);
  }
}

}  // namespace vnreg::detail
