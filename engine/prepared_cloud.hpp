// What a prepared cloud keeps, and how it takes the place of a computed one in the workspace.
#pragma once

#include <utility>

#include "engine/workspace.hpp"

namespace vnreg::detail {

struct PreparedData {
  PreparedData(Model m, const Options& o, Index points)
      : model(std::move(m)), options(o), max_points(points) {}

  // What it was made for.
  Model model;
  Options options;
  Index max_points;

  Status status = Status::degenerate;
  Cloud cloud;
  Floats global;
  Floats paper_descriptors, significance;  // of a model with a fine register
  CloudDescriptors descriptors;            // of architecture `vnreg`
  Surface surface;                         // mode verified

  /// Whether a registrar with this model and these options would compute the same.
  bool serves(const ModelData& other, const Options& wanted, Index points) const noexcept;
  /// The points that were used, as a user would give them.
  PointsView points() const noexcept;
};

/// Copies a side of the workspace: its cloud, features and surface.
void store(const Workspace& workspace, Index side, PreparedData& prepared);

/// Copies the features and the surface into a side of the workspace, which has such sizes already:
/// nothing is allocated.
void load_features(const PreparedData& prepared, Index side, Workspace& workspace) noexcept;

}  // namespace vnreg::detail
