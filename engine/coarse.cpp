#include "engine/coarse.hpp"

#include <cmath>

namespace vnreg::detail {
namespace {

// The second singular value of the covariance, relative to the first, below which its rank counts
// as one: then all features are parallel, or zero.
constexpr double rank_threshold = 1e-8;

kernels::Coordinates rows_of(const Floats& global, Index rows) noexcept {
  return {global.data(), global.data() + rows, global.data() + 2 * rows};
}

}  // namespace

CoarsePose register_coarse(const ModelData& model, Workspace& w) noexcept {
  const Index channels = model.arch.channels_global;
  const Index rows = kernels::padded(channels);
  const kernels::ProcrustesSolution solution = kernels::procrustes(
      rows_of(w.features[0].global, rows), rows_of(w.features[1].global, rows), nullptr, channels);
  const Eigen::Vector3d& s = solution.singular_values;
  const bool determined = std::isfinite(s(0)) && s(1) > rank_threshold * s(0);
  if (determined) w.recorder.pose("", "coarse.T", solution.transform);
  return {solution.transform, determined};
}

}  // namespace vnreg::detail
