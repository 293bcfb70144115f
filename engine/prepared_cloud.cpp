#include "engine/prepared_cloud.hpp"

namespace vnreg {
namespace detail {

bool PreparedData::serves(const ModelData& other, const Options& wanted,
                          Index points) const noexcept {
  return &model.data() == &other && options.mode == wanted.mode && options.seed == wanted.seed &&
         max_points == points;
}

PointsView PreparedData::points() const noexcept {
  return {cloud.xyz.data(), static_cast<std::size_t>(cloud.count)};
}

void store(const Workspace& w, Index side, PreparedData& p) {
  const Features& f = w.features[side];
  p.cloud = w.cloud[side];
  p.global = f.global;
  p.paper_descriptors = f.descriptors;
  p.significance = f.significance;
  p.descriptors = w.descriptors.features[side].out;
  p.surface = w.verified.surface[side];
}

void load_features(const PreparedData& p, Index side, Workspace& w) noexcept {
  Features& f = w.features[side];
  f.global = p.global;
  f.descriptors = p.paper_descriptors;
  f.significance = p.significance;
  w.descriptors.features[side].out = p.descriptors;
  w.verified.surface[side] = p.surface;
}

}  // namespace detail

Status PreparedCloud::status() const noexcept { return data_->status; }

std::size_t PreparedCloud::size() const noexcept {
  return static_cast<std::size_t>(data_->cloud.count);
}

}  // namespace vnreg
