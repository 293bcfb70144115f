#include "engine/verified_workspace.hpp"

#include <algorithm>

#include "engine/pair_table.hpp"

namespace vnreg::detail {

VerifiedWorkspace::VerifiedWorkspace(Index max_points, Index encoded)
    : surface{Surface(max_points), Surface(max_points)},
      hypotheses(static_cast<std::size_t>(draw_chunks * kept_per_chunk + most_match_hypotheses)),
      kept(static_cast<std::size_t>(draw_chunks)),
      poses(static_cast<std::size_t>(final_poses + most_given + refined_poses)) {
  const auto points = static_cast<std::size_t>(std::min(max_points, table_points));
  table.keys.resize(points * points);
  table.pairs.resize(points * points);
  table.start.resize(pair_keys + 2);
  if (encoded > 0) {
    match = MatchBuffers(encoded);
    shared = SharedPoints(encoded);
  }
}

}  // namespace vnreg::detail
