// Working memory of the hypotheses from matches, sized once.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/motion.hpp"
#include "kernels/packets.hpp"

namespace vnreg::detail {

using kernels::Index;

/// Matches that propose poses.
inline constexpr Index most_matches = 256;
/// Matches whose group of compatible ones proposes a pose too.
inline constexpr Index most_seeds = 96;
/// Matches of such a group.
inline constexpr Index group_size = 12;
/// Two poses of every match, one of every seed.
inline constexpr Index most_match_hypotheses = 2 * most_matches + most_seeds;
/// Rows and columns of a product that Eigen packs on the stack.
inline constexpr Index product_block = 128;

struct Match {
  float weight = 0;
  std::uint16_t source = 0, target = 0;  // of the encoded points
};

struct MatchBuffers {
  kernels::Floats similarity;  // source x target: exp(similarity - largest)
  float largest = 0;
  kernels::Floats row_sum, column_sum, column_weight;
  kernels::Floats block_largest, block_sum;  // per product_block rows; their column sums
  std::vector<Match> matches;
  kernels::Floats place[2][3];             // of the matches' points, per cloud and axis
  kernels::Floats compatibility, support;  // matches x matches
  kernels::Floats total_support;
  std::vector<std::uint16_t> seeds;
  std::vector<Motion> motions;  // what the matches propose

  MatchBuffers() = default;
  /// For clouds with at most `encoded` described points.
  explicit MatchBuffers(Index encoded);
};

}  // namespace vnreg::detail
