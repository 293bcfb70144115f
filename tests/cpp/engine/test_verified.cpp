// Mode `verified`: its parts against naive answers, and the poses that come out.
#include <catch2/catch.hpp>
#include <functional>
#include <set>

#include "clouds.hpp"
#include "engine/pair_table.hpp"
#include "engine/refine.hpp"
#include "engine/surface.hpp"
#include "engine/verify.hpp"
#include "engine/workspace.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

using detail::Index;
using detail::Surface;

const Model& any_model() {
  static const Model model = random_model({.fine_iterations = 0}).build();
  return model;
}

PointsView view(const Points& points) { return {points[0].data(), points.size()}; }

/// The surfaces that mode `verified` makes of two clouds.
struct Surfaces {
  Surfaces(const Points& source, const Points& target, Index max_points = 1024)
      : workspace(any_model().data(), {.mode = Mode::verified, .threads = 1}, max_points) {
    const Points* points[2] = {&source, &target};
    for (int side = 0; side < 2; ++side) {
      detail::Cloud& cloud = workspace.cloud[side];
      REQUIRE(detail::gather(view(*points[side]), 24, 0, cloud) == Status::ok);
      REQUIRE(detail::normalize(1.0, cloud));
      cloud.index.build(cloud.coordinates(), cloud.count);
    }
    built = detail::build_surfaces(workspace);
  }

  const Surface& operator[](std::size_t side) const { return workspace.verified.surface[side]; }
  const Surface* both() const { return workspace.verified.surface; }

  detail::Workspace workspace;
  bool built = false;
};

/// Points on the sides of a box with the given half sides about `centre`.
void add_box(Points& points, std::size_t count, const Eigen::Vector3d& centre,
             const Eigen::Vector3d& half, Random& random) {
  const double areas[3] = {half.y() * half.z(), half.x() * half.z(), half.x() * half.y()};
  std::discrete_distribution<int> side(areas, areas + 3);
  for (std::size_t i = 0; i < count; ++i) {
    const int axis = side(random.engine());
    Eigen::Vector3d p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    p(axis) = p(axis) < 0 ? -1 : 1;
    p = centre + p.cwiseProduct(half);
    points.push_back({p.x(), p.y(), p.z()});
  }
}

/// A chair with one arm: no motion maps it onto itself.
Points chair(std::size_t count, Random& random) {
  Points points;
  add_box(points, count * 3 / 10, {0, 0, 0}, {0.25, 0.22, 0.03}, random);
  add_box(points, count * 3 / 10, {0, 0.2, 0.3}, {0.25, 0.03, 0.27}, random);
  add_box(points, count / 10, {0.24, 0, 0.15}, {0.03, 0.2, 0.02}, random);
  for (const double x : {-0.22, 0.22}) {
    for (const double y : {-0.19, 0.19})
      add_box(points, count * 3 / 40, {x, y, -0.22}, {0.025, 0.025, 0.2}, random);
  }
  return points;
}

void add_noise(Points& points, double deviation, Random& random) {
  for (auto& p : points) {
    for (double& value : p) value += deviation * random.normal();
  }
}

/// The share of the points that lies farthest along a direction.
Points cropped(Points points, const Eigen::Vector3d& direction, double share) {
  std::sort(points.begin(), points.end(), [&](const auto& a, const auto& b) {
    return direction.dot(Eigen::Vector3d(a[0], a[1], a[2])) >
           direction.dot(Eigen::Vector3d(b[0], b[1], b[2]));
  });
  points.resize(static_cast<std::size_t>(share * static_cast<double>(points.size())));
  return points;
}

Points shuffled(Points points, Random& random) {
  std::shuffle(points.begin(), points.end(), random.engine());
  return points;
}

double normal_error_deg(const Surface& s, std::size_t i, const Eigen::Vector3d& truth) {
  const Eigen::Vector3d normal(static_cast<double>(s.normal_x[i]),
                               static_cast<double>(s.normal_y[i]),
                               static_cast<double>(s.normal_z[i]));
  CHECK(std::abs(normal.norm() - 1) < 1e-5);
  return std::acos(std::min(1.0, std::abs(normal.dot(truth)))) * 180 / std::numbers::pi;
}

TEST_CASE("normals of a noisy plane and a noisy sphere") {
  Random random(101);
  for (const double noise : {0.0, 0.004}) {
    Points plane, sphere;
    for (int i = 0; i < 1000; ++i) {
      plane.push_back({random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0});
      const Eigen::Vector3d v =
          Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      sphere.push_back({0.5 * v.x(), 0.5 * v.y(), 0.5 * v.z()});
    }
    add_noise(plane, noise, random);
    add_noise(sphere, noise, random);
    const Surfaces s(plane, sphere);
    REQUIRE(s.built);
    double errors[2] = {0, 0};
    for (std::size_t i = 0; i < 1000; ++i) {
      const Eigen::Vector3d radial =
          Eigen::Vector3f(s[1].x[i], s[1].y[i], s[1].z[i]).cast<double>();
      errors[0] += normal_error_deg(s[0], i, {0, 0, 1}) / 1000;
      errors[1] += normal_error_deg(s[1], i, radial.normalized()) / 1000;
    }
    CAPTURE(noise, errors[0], errors[1]);
    REQUIRE(errors[0] < (noise > 0 ? 6 : 0.01));
    REQUIRE(errors[1] < (noise > 0 ? 8 : 3));
  }
}

TEST_CASE(
    "surfaces hold every point once, or an even choice of at most 2,048, spread in any prefix") {
  Random random(102);
  for (const std::size_t count : {24u, 100u, 1024u, 2048u, 2049u, 5000u}) {
    const Points points = chair(count, random);
    const Surfaces s(points, points, 16384);
    CAPTURE(count);
    REQUIRE(s[0].count == std::min<Index>(static_cast<Index>(points.size()), 2048));
    std::set<std::array<float, 3>> distinct;
    double sum = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(s[0].count); ++i) {
      distinct.insert({s[0].x[i], s[0].y[i], s[0].z[i]});
      if (i < 20) sum += static_cast<double>(s[0].z[i]);
    }
    REQUIRE(static_cast<Index>(distinct.size()) == s[0].count);
    // The centroid is at 0, and the chair's z varies by 0.7 radii.
    REQUIRE(std::abs(sum / 20) < 0.35);
  }
}

TEST_CASE("exact search finds the nearest point nearly always, and never one beyond the cell's") {
  Random random(103);
  const Points source = chair(700, random);
  const Surfaces s(source, chair(900, random));
  const detail::Motion identity = detail::to_motion({});
  Index missed = 0;
  for (Index first = 0; first < s[0].count; first += 50) {
    detail::Matches cell, exact;
    const Index count = std::min<Index>(50, s[0].count - first);
    detail::match_points(identity, s[0], first, count, s[1], detail::Search::cell, cell);
    detail::match_points(identity, s[0], first, count, s[1], detail::Search::exact, exact);
    for (Index i = 0; i < count; ++i) {
      float nearest = std::numeric_limits<float>::max();
      for (std::size_t j = 0; j < static_cast<std::size_t>(s[1].count); ++j) {
        const float dx = s[1].x[j] - exact.x[i], dy = s[1].y[j] - exact.y[i];
        const float dz = s[1].z[j] - exact.z[i];
        nearest = std::min(nearest, dx * dx + dy * dy + dz * dz);
      }
      REQUIRE(exact.squared[i] <= cell.squared[i] * 1.0001f);
      REQUIRE(exact.squared[i] >= nearest * 0.9999f);
      if (exact.squared[i] > nearest * 1.0001f + 1e-9f) ++missed;
    }
  }
  CAPTURE(missed);
  REQUIRE(missed <= s[0].count / 100);
}

TEST_CASE("the score is 1 for identical surfaces, small for another pose, the same both ways") {
  Random random(104);
  const Points source = chair(1000, random);
  const Surfaces s(source, source);
  const auto score = [&](const detail::Motion& motion, const Surface* surfaces) {
    return detail::two_sided_score(motion, surfaces, 2048, 0.1f, detail::Search::exact);
  };
  REQUIRE(score(detail::to_motion({}), s.both()) > 0.999f);
  kernels::RigidTransform turned;
  turned.rotation = Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  const detail::Motion motion = detail::to_motion(turned);
  const float one_way = score(motion, s.both());
  REQUIRE(one_way < 0.3f);
  // Source and target are the same surface here, so the inverse motion swaps their parts.
  REQUIRE(score(detail::inverse(motion), s.both()) == Approx(one_way).epsilon(1e-4));
}

TEST_CASE("the pair table holds all pairs of the target's first points under their keys") {
  Random random(105);
  for (const std::size_t count : {40u, 1000u}) {
    Surfaces s(chair(500, random), chair(count, random));
    detail::fill_pair_table(s.workspace);
    const detail::PairTable& table = s.workspace.verified.table;
    const Index n = std::min<Index>(detail::table_points, s[1].count);
    std::size_t expected = 0;
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) expected += detail::pair_key(s[1], i, j) != detail::no_pair_key;
    }
    REQUIRE(table.start[0] == 0);
    REQUIRE(table.start[detail::pair_keys] == expected);
    std::set<std::pair<int, int>> distinct;
    for (std::uint32_t key = 0; key < detail::pair_keys; ++key) {
      for (std::uint32_t p = table.start[key]; p < table.start[key + 1]; ++p) {
        REQUIRE(detail::pair_key(s[1], table.pairs[p].first, table.pairs[p].second) == key);
        distinct.insert({table.pairs[p].first, table.pairs[p].second});
      }
    }
    REQUIRE(distinct.size() == expected);
  }
}

TEST_CASE("refinement ends at the truth from a start nearby") {
  Random random(106);
  const Points source = chair(1000, random);
  const Surfaces s(source, source);
  for (int trial = 0; trial < 20; ++trial) {
    kernels::RigidTransform start;
    const Eigen::Vector3d axis(random.normal(), random.normal(), random.normal());
    start.rotation = Eigen::AngleAxisd(0.05, axis.normalized()).matrix();
    start.translation = 0.02 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const kernels::RigidTransform end =
        detail::refine(start, s.both(), {2048, 0.1f, 30, detail::Search::exact});
    REQUIRE((end.rotation - Eigen::Matrix3d::Identity()).norm() < 1e-3);
    REQUIRE(end.translation.norm() < 1e-3);
    REQUIRE((end.rotation * end.rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12);
  }
}

struct Error2 {
  double degrees, distance;
};

Error2 error_of(const Pose& pose, const Eigen::Isometry3d& truth) {
  const Eigen::Isometry3d motion = motion_of(pose);
  return {rotation_error_deg(motion, truth), (motion.translation() - truth.translation()).norm()};
}

TEST_CASE("identical points give the exact pose") {
  Random random(107);
  Registrar registrar(any_model(), {.mode = Mode::verified, .threads = 1});
  for (int trial = 0; trial < 6; ++trial) {
    const Points source = trial % 2 == 0 ? chair(1000, random) : shape(1024, random);
    const Eigen::Isometry3d truth = random_motion(random, 1);
    const Points target = shuffled(moved(source, truth), random);
    const Result& r = registrar.align(source, target);
    const Error2 error = error_of(r.T_target_source, truth);
    CAPTURE(trial, error.degrees, error.distance);
    REQUIRE(r.status == Status::ok);
    REQUIRE(error.degrees < 0.1);
    REQUIRE(error.distance < 1e-3);
    REQUIRE(r.score > 0.98);
    REQUIRE(r.overlap > 0.99);
  }
}

TEST_CASE("independent, noisy and cropped samples of a chair give its pose, in any units") {
  Random random(108);
  Registrar coarse_only(any_model(), {.mode = Mode::verified, .threads = 1});
  Registrar with_fine(random_model().build(), {.mode = Mode::verified, .threads = 1});
  struct Case {
    const char* name;
    double noise, share, degrees;
  };
  for (const Case& c : {Case{"independent", 0, 1, 1}, Case{"noisy", 0.006, 1, 3},
                        Case{"cropped", 0, 0.75, 3}, Case{"all", 0.003, 0.8, 4}}) {
    int right = 0;
    for (int trial = 0; trial < 5; ++trial) {
      const double scale = std::pow(10.0, 3 * (trial - 2));
      const Eigen::Isometry3d truth = random_motion(random, 1);
      Points clouds[2];
      for (Points& cloud : clouds) {
        const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
        cloud = cropped(chair(1000, random), direction, c.share);
        add_noise(cloud, c.noise, random);
      }
      const Points source = moved(clouds[0], Eigen::Isometry3d::Identity(), scale);
      const Points target = moved(clouds[1], truth, scale);
      const Result& r = (trial % 2 == 0 ? coarse_only : with_fine).align(source, target);
      REQUIRE(r.has_pose);
      Pose pose = r.T_target_source;
      for (const std::size_t i : {3u, 7u, 11u}) pose[i] /= scale;
      const Error2 error = error_of(pose, truth);
      UNSCOPED_INFO(c.name << ' ' << trial << ": " << error.degrees << " deg " << error.distance);
      right += error.degrees < c.degrees && error.distance < 0.04 ? 1 : 0;
    }
    CHECK(right >= (c.share < 1 ? 4 : 5));
  }
}

TEST_CASE("a symmetric body is ambiguous, and the other poses are its alternatives") {
  Random random(109);
  Points source, sample;
  add_box(source, 1000, {0, 0, 0}, {0.5, 0.3, 0.15}, random);
  add_box(sample, 1000, {0, 0, 0}, {0.5, 0.3, 0.15}, random);
  const Eigen::Isometry3d truth = random_motion(random, 1);
  Registrar registrar(any_model(), {.mode = Mode::verified, .threads = 1});
  const Result& r = registrar.align(source, moved(sample, truth));
  REQUIRE(r.status == Status::ambiguous);
  REQUIRE(r.has_pose);
  std::vector<Pose> answers{r.T_target_source};
  double previous = r.score;
  for (const Alternative& alternative : r.alternatives) {
    answers.push_back(alternative.T_target_source);
    REQUIRE(alternative.score <= previous);
    REQUIRE(alternative.score >= 0.8 * r.score);
    previous = alternative.score;
  }
  // Half turns about its three axes map the box onto itself.
  for (int axis = -1; axis < 3; ++axis) {
    Eigen::Isometry3d symmetric = truth;
    if (axis >= 0) {
      symmetric = truth * Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::Unit(axis));
    }
    const auto found = std::count_if(answers.begin(), answers.end(), [&](const Pose& pose) {
      const Error2 error = error_of(pose, symmetric);
      return error.degrees < 3 && error.distance < 0.05;
    });
    CAPTURE(axis);
    REQUIRE(found == 1);
  }
}

TEST_CASE("the number of threads, and what came before, change no bit of a verified pose") {
  Random random(110);
  for (const std::size_t count : {64u, 333u, 1024u}) {
    const Points source = chair(count, random);
    const Points target = moved(chair(count, random), random_motion(random, 1));
    Registrar one(any_model(), {.mode = Mode::verified, .threads = 1, .seed = 5});
    const Result expected = one.align(source, target);
    for (const int threads : {1, 2, 3, 8}) {
      Registrar several(any_model(), {.mode = Mode::verified, .threads = threads, .seed = 5});
      several.align(target, chair(200, random));
      const Result& r = several.align(source, target);
      CAPTURE(count, threads);
      REQUIRE(r.T_target_source == expected.T_target_source);
      REQUIRE(r.score == expected.score);
      REQUIRE(r.status == expected.status);
      REQUIRE(r.alternatives.size() == expected.alternatives.size());
      for (std::size_t i = 0; i < r.alternatives.size(); ++i) {
        REQUIRE(r.alternatives[i].T_target_source == expected.alternatives[i].T_target_source);
        REQUIRE(r.alternatives[i].score == expected.alternatives[i].score);
      }
    }
  }
}

TEST_CASE("degenerate clouds give a finite pose or a status, never a crash") {
  Random random(111);
  const auto make = [](std::size_t count, const std::function<std::array<double, 3>()>& point) {
    Points points(count);
    for (auto& p : points) p = point();
    return points;
  };
  const auto direction = [&] {
    return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized().eval();
  };
  const Points plane = make(500, [&] {
    return std::array{random.uniform(-1, 1), random.uniform(-1, 1), 0.0};
  });
  const Points sphere = make(500, [&] {
    const Eigen::Vector3d v = direction();
    return std::array{v.x(), v.y(), v.z()};
  });
  const Points line = make(200, [&] {
    const double t = random.normal();
    return std::array{t, 2 * t, -t};
  });
  const Points three = make(99, [&, i = 0]() mutable {
    ++i;
    return std::array{i % 3 == 0 ? 1.0 : 0.0, i % 3 == 1 ? 2.0 : 0.0, 0.0};
  });
  const Points body = shape(24, random);
  Points outlier = shape(300, random);
  outlier[0] = {1e6, -1e6, 1e6};
  const Points tiny = moved(shape(64, random), Eigen::Isometry3d::Identity(), 1e-30);
  const Points huge = moved(shape(64, random), Eigen::Isometry3d::Identity(), 1e30);
  const Points doubled =
      make(300, [&, i = 0]() mutable { return body[static_cast<std::size_t>(i++ % 24)]; });
  const Points equal(100, {1, 2, 3});
  const std::vector<const Points*> all{&plane,   &sphere, &line, &three,   &body,
                                       &outlier, &tiny,   &huge, &doubled, &equal};
  for (const double radius : {0.5, 0.0}) {
    Registrar registrar(random_model({.rms_radius = radius}).build(),
                        {.mode = Mode::verified, .threads = 1});
    for (std::size_t a = 0; a < all.size(); ++a) {
      for (std::size_t b = 0; b < all.size(); ++b) {
        const Result& r = registrar.align(*all[a], *all[b]);
        CAPTURE(radius, a, b, to_string(r.status));
        REQUIRE(r.has_pose == (r.status == Status::ok || r.status == Status::ambiguous ||
                               r.status == Status::low_confidence));
        for (const double value : r.T_target_source) REQUIRE(std::isfinite(value));
        for (const Alternative& alternative : r.alternatives) {
          for (const double value : alternative.T_target_source) REQUIRE(std::isfinite(value));
        }
        if (all[a] == &equal || all[b] == &equal) REQUIRE(r.status == Status::degenerate);
        if (all[a] == &line || all[b] == &line) REQUIRE(r.status == Status::degenerate);
      }
    }
  }
}

TEST_CASE("the other modes have no score and no alternatives") {
  Random random(112);
  const Points cloud = chair(200, random);
  Registrar registrar(random_model().build(), {.mode = Mode::paper});
  const Result& r = registrar.align(cloud, cloud);
  REQUIRE(std::isnan(r.score));
  REQUIRE(r.alternatives.empty());
  REQUIRE(r.ms.hypotheses == 0);
  REQUIRE(r.ms.verify == 0);
  REQUIRE(to_string(Mode::verified) == "verified");
  REQUIRE(to_string(Status::ambiguous) == "ambiguous");
}

}  // namespace
}  // namespace vnreg::test
