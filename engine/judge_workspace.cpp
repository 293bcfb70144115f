#include "engine/judge_workspace.hpp"

#include <algorithm>

#include "engine/verified_workspace.hpp"

namespace vnreg::detail {
namespace {

using kernels::padded;

void allocate(kernels::Floats& buffer, Index size) {
  buffer.assign(static_cast<std::size_t>(size), 0.0f);
}

JudgeScratch make_scratch(const JudgeModel* model, Index leaves) {
  JudgeScratch s;
  allocate(s.leaf_bounds, padded(leaves));
  s.matches.resize(most_judged_points / Matches::capacity);
  allocate(s.inputs, 2 * most_judged_points * padded(judge_point_inputs));
  if (model == nullptr) return s;
  const Index hidden = model->point[0].padded_rows();
  for (kernels::Floats& h : s.hidden) allocate(h, 2 * most_judged_points * hidden);
  allocate(s.pose_inputs, padded(hidden + judge_pose_inputs));
  allocate(s.pose_hidden, model->pose[0].padded_rows());
  allocate(s.logit, model->pose[1].padded_rows());
  return s;
}

}  // namespace

JudgedCloud::JudgedCloud(Index max_points, Index most_encoded) : described(most_encoded) {
  for (kernels::Floats* array :
       {&points.x, &points.y, &points.z, &points.normal_x, &points.normal_y, &points.normal_z}) {
    allocate(*array, most_judged_points);
  }
  nearest_encoded.resize(static_cast<std::size_t>(std::min(max_points, most_surface_points)));
  allocate(log_sum, most_encoded);
}

JudgeWorkspace::JudgeWorkspace(const JudgeModel* judge, Index max_points, Index encoded,
                               Index threads, bool record)
    : model(judge), cloud{JudgedCloud(max_points, encoded), JudgedCloud(max_points, encoded)} {
  const Index leaves =
      std::min(max_points, most_surface_points) / kernels::SpatialIndex::leaf_size + 1;
  for (Index i = 0; i < threads; ++i) scratch.push_back(make_scratch(judge, leaves));
  if (record) allocate(recorded, final_poses * 2 * most_judged_points * padded(judge_point_inputs));
}

}  // namespace vnreg::detail
