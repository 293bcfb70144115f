#include "engine/match_buffers.hpp"

namespace vnreg::detail {

MatchBuffers::MatchBuffers(Index encoded) {
  const auto points = static_cast<std::size_t>(encoded);
  const auto most = static_cast<std::size_t>(most_matches);
  similarity.resize(points * points);
  for (kernels::Floats* buffer : {&row_sum, &column_sum, &column_weight}) {
    buffer->resize(points);
  }
  const std::size_t blocks = (points + product_block - 1) / product_block;
  block_largest.resize(blocks);
  block_sum.resize(blocks * points);
  matches.reserve(2 * points);
  for (auto& cloud : place) {
    for (kernels::Floats& axis : cloud) axis.resize(most);
  }
  compatibility.resize(most * most);
  support.resize(most * most);
  total_support.resize(most);
  seeds.resize(most);
  motions.resize(static_cast<std::size_t>(most_match_hypotheses));
}

}  // namespace vnreg::detail
