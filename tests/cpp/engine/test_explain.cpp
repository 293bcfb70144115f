// What Registrar::explain() tells of an answer.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <set>

#include "clouds.hpp"
#include "random_descriptor_model.hpp"
#include "same_result.hpp"

namespace vnreg::test {
namespace {

struct Pair {
  Random random{61};
  Points source = shape(400, random);
  Eigen::Isometry3d truth = random_motion(random, 100);
  Points target = moved(shape(380, random), truth);
};

bool empty(const Explanation& e) {
  return e.source.empty() && e.target.empty() && e.matches.empty() && e.hypotheses.empty();
}

/// Every described point is one of the cloud's, to the last bit, and no two are the same.
void check_points(const std::vector<Explanation::Point>& described, const Points& cloud) {
  const std::set<std::array<double, 3>> known(cloud.begin(), cloud.end());
  std::set<std::array<double, 3>> seen;
  for (const Explanation::Point& point : described) {
    REQUIRE(known.contains(point.position));
    REQUIRE(seen.insert(point.position).second);
    REQUIRE((point.significance >= 0 && point.significance <= 1));
  }
}

void check_matches(const Explanation& e) {
  double last = std::numeric_limits<double>::infinity();
  for (const Explanation::Match& match : e.matches) {
    REQUIRE(match.source < e.source.size());
    REQUIRE(match.target < e.target.size());
    REQUIRE((match.weight > 0 && match.weight <= last));
    last = match.weight;
  }
}

/// Median distance of the heaviest matches from each other at the pose.
double match_distance(const Explanation& e, const Eigen::Isometry3d& pose) {
  std::vector<double> distances;
  for (std::size_t i = 0; i < std::min<std::size_t>(e.matches.size(), 40); ++i) {
    const Eigen::Vector3d from(e.source[e.matches[i].source].position.data());
    const Eigen::Vector3d to(e.target[e.matches[i].target].position.data());
    distances.push_back((pose * from - to).norm());
  }
  std::nth_element(distances.begin(), distances.begin() + 20, distances.end());
  return distances[20];
}

TEST_CASE_METHOD(Pair, "explain: mode verified tells points, matches and hypotheses") {
  Registrar registrar(Model::builtin(), {.threads = 1});
  REQUIRE(empty(registrar.explain()));
  const Result result = registrar.align(source, target);
  const Explanation e = registrar.explain();
  check_points(e.source, source);
  check_points(e.target, target);
  check_matches(e);
  REQUIRE(e.matches.size() == 256);
  // The object is about 1 long, and lies about 100 from the origin.
  REQUIRE(match_distance(e, motion_of(result.T_target_source)) < 0.1);
  REQUIRE((!e.hypotheses.empty() && e.hypotheses.size() <= 12));
  REQUIRE(e.hypotheses[0].score == result.score);
  REQUIRE(e.hypotheses[0].T_target_source == result.T_target_source);
}

TEST_CASE_METHOD(Pair, "explain: the alternatives of a symmetric object are among the hypotheses") {
  Registrar registrar(Model::builtin(), {.threads = 1});
  const Result result = registrar.align(box(200, random), moved(box(200, random), truth));
  const Explanation e = registrar.explain();
  REQUIRE(!result.alternatives.empty());
  REQUIRE(e.hypotheses.size() > result.alternatives.size());
  for (std::size_t i = 1; i < e.hypotheses.size(); ++i) {
    REQUIRE(e.hypotheses[i].score <= e.hypotheses[i - 1].score);
  }
  for (const Alternative& other : result.alternatives) {
    REQUIRE(std::ranges::any_of(e.hypotheses, [&](const Alternative& h) {
      return h.score == other.score && h.T_target_source == other.T_target_source;
    }));
  }
}

TEST_CASE_METHOD(Pair, "explain: prepared clouds give the same, and prepare() forgets") {
  Registrar registrar(Model::builtin(), {.threads = 1});
  target = moved(shape(380, random), truth, 1.1);  // the larger cloud sets the unit of both
  const PreparedCloud prepared = registrar.prepare(target);
  REQUIRE(empty(registrar.explain()));
  registrar.align(source, target);
  const Explanation expected = registrar.explain();
  registrar.align(source, prepared);
  const Explanation got = registrar.explain();
  REQUIRE(got.matches.size() == expected.matches.size());
  for (std::size_t i = 0; i < got.matches.size(); ++i) {
    REQUIRE(got.matches[i].source == expected.matches[i].source);
    REQUIRE(got.target[got.matches[i].target].position ==
            expected.target[expected.matches[i].target].position);
  }
  registrar.prepare(source);
  REQUIRE(empty(registrar.explain()));
}

TEST_CASE_METHOD(Pair, "explain: modes coarse and paper") {
  const Model paper = random_model().build();
  Registrar fine(paper, {.mode = Mode::paper, .threads = 1});
  const Result result = fine.align(source, target);
  REQUIRE(result.has_pose);
  const Explanation e = fine.explain();
  REQUIRE(e.source.size() == source.size());
  check_points(e.source, source);
  check_points(e.target, target);
  check_matches(e);
  REQUIRE(!e.matches.empty());
  const double sum =
      std::accumulate(e.matches.begin(), e.matches.end(), 0.0,
                      [](double total, const auto& match) { return total + match.weight; });
  REQUIRE(sum == Approx(1).margin(1e-4));
  REQUIRE(e.hypotheses.size() == 2);
  REQUIRE(e.hypotheses[0].T_target_source == result.T_target_source);
  REQUIRE(e.hypotheses[1].T_target_source == result.T_target_source_coarse);
  REQUIRE(std::isnan(e.hypotheses[0].score));

  Registrar coarse(Model::builtin(), {.mode = Mode::coarse, .threads = 1});
  coarse.align(source, target);
  REQUIRE(coarse.explain().source.size() > 100);
  REQUIRE(coarse.explain().matches.empty());
  REQUIRE(coarse.explain().hypotheses.size() == 1);
}

TEST_CASE_METHOD(Pair, "explain: nothing of the call before is left when a call comes to nothing") {
  Registrar registrar(Model::builtin(), {.threads = 1});
  registrar.align(source, target);
  REQUIRE(!empty(registrar.explain()));
  REQUIRE(registrar.align(Points(3), target).status == Status::too_few_points);
  REQUIRE(empty(registrar.explain()));
  Cancellation cancellation;
  Registrar cancelled(Model::builtin(), {.threads = 1, .cancellation = &cancellation});
  cancelled.align(source, target);
  cancellation.request();
  REQUIRE(cancelled.align(source, target).status == Status::cancelled);
  REQUIRE(empty(cancelled.explain()));
}

TEST_CASE_METHOD(Pair, "explain: asking changes no answer") {
  Registrar registrar(Model::builtin(), {.threads = 1});
  const Result expected = registrar.align(source, target);
  registrar.explain();
  check_same(registrar.align(source, target), expected);
}

}  // namespace
}  // namespace vnreg::test
