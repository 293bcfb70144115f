// What the judge is told, and what becomes of what it says.
#include "engine/judge_inputs.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "clouds.hpp"
#include "engine/match_hypotheses.hpp"
#include "prepared_pair.hpp"

namespace vnreg::test {
namespace {

using Inputs = std::vector<float>;  // judge_point_inputs per point, source first

// Places in a point's inputs (docs/design.md).
constexpr std::size_t distance_input = 0, cosine_input = 2, unmatched_input = 3, own_weight = 6,
                      weight_difference = 7, offset_difference = 8, spread_difference = 11,
                      local_agreement = 22, own_noise = 28, other_noise = 29;

struct Judged {
  Inputs inputs;
  std::size_t source_points, target_points;

  float at(std::size_t point, std::size_t input) const {
    return inputs[point * static_cast<std::size_t>(detail::judge_point_inputs) + input];
  }
  std::size_t points() const { return source_points + target_points; }
  float mean(std::size_t input) const {
    float sum = 0;
    for (std::size_t i = 0; i < points(); ++i) sum += at(i, input);
    return sum / static_cast<float>(points());
  }
};

void make_ready(PreparedPair& pair) {
  pair.describe();
  detail::propose_from_matches(pair.workspace());
  detail::choose_judged_points(pair.workspace());
  detail::describe_judged_points(0, detail::most_judged_points, pair.workspace());
}

Judged inputs_at(PreparedPair& pair, const detail::Motion& motion,
                 detail::Index most = detail::most_judged_points) {
  detail::Workspace& w = pair.workspace();
  detail::JudgeScratch& s = w.verified.judge.scratch[0];
  const detail::Index columns = detail::write_judge_inputs(motion, most, w, s);
  const auto points_of = [&](const detail::JudgedCloud& cloud) {
    return static_cast<std::size_t>(std::min(most, cloud.points.count));
  };
  Judged out{{}, points_of(w.verified.judge.cloud[0]), points_of(w.verified.judge.cloud[1])};
  REQUIRE(static_cast<std::size_t>(columns) == out.points());
  for (detail::Index c = 0; c < columns; ++c) {
    const float* column = s.inputs.data() + c * kernels::padded(detail::judge_point_inputs);
    out.inputs.insert(out.inputs.end(), column, column + detail::judge_point_inputs);
  }
  return out;
}

TEST_CASE("the right pose of a moved copy leaves nothing to say against it") {
  Random random(261);
  for (const std::size_t count : {65u, 700u, 1024u}) {
    const Points source = shape(count, random);
    const Eigen::Isometry3d truth = random_motion(random, 2);
    PreparedPair pair(source, moved(source, truth));
    make_ready(pair);
    const Judged right = inputs_at(pair, pair.surface_motion(truth));
    std::size_t missed = 0;  // the search for the nearest point is not exact
    for (std::size_t i = 0; i < right.points(); ++i) {
      REQUIRE(right.at(i, unmatched_input) == 0.0f);
      missed += right.at(i, distance_input) < 1e-2f && right.at(i, cosine_input) > 0.999f ? 0 : 1;
      REQUIRE(std::abs(right.at(i, weight_difference)) < 1e-2f);
      REQUIRE(right.at(i, offset_difference) < 1e-2f);
      REQUIRE(right.at(i, spread_difference) < 1e-2f);
    }
    REQUIRE(100 * missed <= right.points());
    const Judged wrong = inputs_at(
        pair, pair.surface_motion(truth * Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitX())));
    REQUIRE(wrong.mean(distance_input) > 0.2f);
    REQUIRE(wrong.mean(offset_difference) > right.mean(offset_difference) + 0.05f);
    REQUIRE(wrong.mean(local_agreement) < right.mean(local_agreement));
  }
}

TEST_CASE("swapped clouds and the inverse pose swap the inputs") {
  Random random(262);
  const Eigen::Isometry3d truth = random_motion(random, 2);
  const Points source = shape(600, random), target = moved(shape(777, random), truth);
  PreparedPair forth(source, target), back(target, source);
  make_ready(forth);
  make_ready(back);
  const detail::Motion motion = forth.surface_motion(truth);
  const Judged a = inputs_at(forth, motion), b = inputs_at(back, detail::inverse(motion));
  REQUIRE(a.source_points == b.target_points);
  for (std::size_t i = 0; i < a.source_points; ++i) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(detail::judge_point_inputs); ++k) {
      CAPTURE(i, k);
      REQUIRE(a.at(i, k) == Approx(b.at(b.source_points + i, k)).margin(1e-3));
    }
  }
}

TEST_CASE("a look at few points sees the first of them") {
  Random random(265);
  const Eigen::Isometry3d truth = random_motion(random, 2);
  const Points source = shape(800, random);
  PreparedPair pair(source, moved(source, truth));
  make_ready(pair);
  const detail::Motion motion = pair.surface_motion(truth);
  const Judged every = inputs_at(pair, motion);
  for (const detail::Index most : {1, 63, 64, 65, 200}) {
    const Judged few = inputs_at(pair, motion, most);
    REQUIRE(few.source_points == static_cast<std::size_t>(most));
    REQUIRE(few.target_points == static_cast<std::size_t>(most));
    for (std::size_t i = 0; i < few.points(); ++i) {
      const std::size_t same =
          i < few.source_points ? i : every.source_points + i - few.source_points;
      for (std::size_t k = 0; k < static_cast<std::size_t>(detail::judge_point_inputs); ++k) {
        CAPTURE(i, k);
        REQUIRE(few.at(i, k) == every.at(same, k));
      }
    }
  }
}

TEST_CASE("poses that lay the clouds far apart have finite inputs") {
  Random random(263);
  const Points source = shape(200, random), target = shape(130, random);
  PreparedPair pair(source, target);
  make_ready(pair);
  for (const double far : {3.0, 1e3, 1e8}) {
    Eigen::Isometry3d pose = random_motion(random, 1);
    pose.translation() += Eigen::Vector3d(far, 0, 0);
    const Judged apart = inputs_at(pair, pair.surface_motion(pose));
    REQUIRE(std::all_of(apart.inputs.begin(), apart.inputs.end(),
                        [](float v) { return std::isfinite(v); }));
    for (std::size_t i = 0; i < apart.points(); ++i) {
      REQUIRE(apart.at(i, unmatched_input) == 1.0f);
      // Not more: flattening may take a point of a thin cloud out of its own surroundings.
      REQUIRE(apart.at(i, own_weight) >= std::log(2e-3f));
    }
  }
}

/// How many described points are on the surface, and after its flattening still nearer to where
/// they were described than to any other described point.
detail::Index described_points_in_place(const detail::Workspace& w, std::size_t side) {
  const detail::CloudDescriptors& d = w.descriptors.features[side].out;
  const detail::Surface& s = w.verified.surface[side];
  const auto unit = static_cast<float>(w.verified.radius);
  detail::Index count = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(s.count); ++i) {
    const auto squared_distance = [&](std::size_t e) {
      const Eigen::Vector3f off(unit * s.x[i] - d.x[e], unit * s.y[i] - d.y[e],
                                unit * s.z[i] - d.z[e]);
      return off.squaredNorm();
    };
    std::size_t nearest = 0;
    for (std::size_t e = 1; e < static_cast<std::size_t>(d.count); ++e) {
      if (squared_distance(e) < squared_distance(nearest)) nearest = e;
    }
    count += d.encoded[nearest] == s.origin[i] ? 1 : 0;
  }
  return count;
}

TEST_CASE("the judged points have descriptors of their own, and the pair's noise") {
  Random random(264);
  Points source = shape(900, random);
  for (auto& p : source) {
    for (double& v : p) v += 0.01 * random.normal();
  }
  PreparedPair pair(source, shape(1024, random));
  make_ready(pair);
  const detail::Workspace& w = pair.workspace();
  for (std::size_t side = 0; side < 2; ++side) {
    const detail::JudgedCloud& c = w.verified.judge.cloud[side];
    const detail::CloudDescriptors& d = w.descriptors.features[side].out;
    REQUIRE(c.points.count == described_points_in_place(w, side));
    REQUIRE(c.points.count > detail::most_judged_points * 9 / 10);
    const auto unit = static_cast<float>(w.verified.radius);
    for (std::size_t i = 0; i < static_cast<std::size_t>(c.points.count); ++i) {
      const auto e = static_cast<detail::Index>(c.encoded[i]);
      const float off = std::hypot(unit * c.points.x[i] - d.x[e], unit * c.points.y[i] - d.y[e],
                                   unit * c.points.z[i] - d.z[e]);
      REQUIRE(off < 3 * unit * pair.spacing());  // flattening moves it
    }
  }
  const Judged inputs = inputs_at(pair, pair.surface_motion(Eigen::Isometry3d::Identity()));
  REQUIRE(inputs.at(0, own_noise) > inputs.at(0, other_noise));
  REQUIRE(inputs.at(inputs.source_points, own_noise) == inputs.at(0, other_noise));
}

}  // namespace
}  // namespace vnreg::test
