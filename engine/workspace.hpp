// All working memory of a Registrar, sized once for its model and its largest cloud.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/cloud.hpp"
#include "engine/descriptor_workspace.hpp"
#include "engine/model_data.hpp"
#include "engine/parallel.hpp"
#include "engine/stage_recorder.hpp"
#include "engine/verified_workspace.hpp"

namespace vnreg::detail {

using kernels::Floats;

/// Points per tile: a tile's features and a panel of weights stay in the L1 and L2 caches.
inline constexpr Index tile_points = 32;

/// Rows of a buffer that holds the three vectors of the invariant layer's frame.
inline constexpr Index frame_rows = kernels::padded(3);

constexpr Index tile_count(Index points) noexcept {
  return (points + tile_points - 1) / tile_points;
}

/// The encoder's activations of one cloud. Vector features lie tile after tile, each tile
/// column-major with columns x | y | z (kernels/vn_linear.hpp).
struct Features {
  Floats edges;        // 3 rows
  Floats latent;       // C rows
  Floats other;        // C or L rows: what the blocks behind the latent compute
  Floats sums;         // per tile, rows x 3
  Floats mean;         // rows x 3
  Floats hidden_mean;  // rows x 3
  kernels::VnBlockConstants constants;
  Floats pooled, direction, global;  // C x 3
  Floats local_global;               // as global, by an encoder of the local module's own
  Floats local, frame;               // L rows and 3 vectors, kept only when stages are recorded
  Floats descriptors;                // D x N
  Floats significance;               // N
};

/// The fine register's view of one cloud: its kept points.
struct KeptPoints {
  std::vector<std::uint64_t> keys;      // of the selection
  std::vector<std::uint32_t> original;  // index in the cloud
  Index count = 0;
  Floats x, y, z;      // network coordinates
  Floats descriptors;  // D x K
  Floats parts;        // P x K: what the first pair layer makes of the descriptors
};

struct FineBuffers {
  KeptPoints kept[2];
  Floats moved_x, moved_y, moved_z;        // source, by the current pose
  Floats matched_x, matched_y, matched_z;  // target points by match
  std::vector<std::uint32_t> match;
  Floats row_maxima, weight_hidden, weight_rows;
  Floats weights, sorted_weights;
  Floats similarity;  // all rows when stages are recorded, else one per thread
};

struct ResidualBuffers {
  Floats moved_x[2], moved_y[2], moved_z[2];  // each cloud, moved onto the other
  Floats squared[2];
  Floats spacing;
};

/// What one thread needs while it works on one tile, or one source point.
struct ThreadScratch {
  kernels::VnScratch block;
  Floats local;                 // output of the last block, L rows
  Floats projected, direction;  // of the invariant layer
  Floats invariant[2], frame;
  Floats products;  // V Z^T
  Floats mlp[3];
  kernels::NeighbourScratch neighbours;
  kernels::PairScratch pairs;
};

/// How far the last align came: what of the memory below is that call's own (engine/explain.hpp).
struct Reached {
  double scale = 1;        // the length that is 1 in network coordinates
  bool described = false;  // significances of both clouds
  bool matched = false;    // matches
  Index considered = 0;    // poses in verified.considered
  bool answered = false;   // the result
};

struct Workspace {
  Workspace(const ModelData& model, const Options& options, Index max_points);

  Deadline deadline;  // of the running call
  Reached reached;
  Threads threads;
  /// The clouds whose points and features the running call computes; the others were prepared.
  Sides sides = both_sides;
  bool local;  // whether the local module and the fine register have memory
  Cloud cloud[2];
  Features features[2];
  FineBuffers fine;
  ResidualBuffers residual;
  VerifiedWorkspace verified;       // empty in the other modes
  DescriptorWorkspace descriptors;  // of architecture `vnreg`, whose `features` hold global alone
  std::vector<ThreadScratch> scratch;
  StageRecorder recorder;

  /// Calls task(side, tile, scratch) for every tile of the clouds to compute, in parallel.
  template <class Task>
  void for_each_tile(const Task& task) noexcept {
    parallel_for_parts(
        threads, sides, [&](Index side) { return tile_count(cloud[side].count); },
        [&](Index side, Index tile, int thread) {
          task(side, tile, scratch[static_cast<std::size_t>(thread)]);
        });
  }
};

/// Prefix of a cloud's stages.
inline const char* side_name(Index side) noexcept { return side == 0 ? "source." : "target."; }

}  // namespace vnreg::detail
