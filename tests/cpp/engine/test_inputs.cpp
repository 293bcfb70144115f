// Whatever the input, align() returns: a finite rigid pose, or a status that says why there is
// none.
#include <catch2/catch.hpp>
#include <cstring>
#include <limits>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

bool is_rigid(const Pose& pose) {
  const Eigen::Isometry3d m = motion_of(pose);
  return m.matrix().allFinite() && (m.linear() * m.linear().transpose()).isIdentity(1e-9) &&
         std::abs(m.linear().determinant() - 1) < 1e-9 && pose[12] == 0 && pose[13] == 0 &&
         pose[14] == 0 && pose[15] == 1;
}

void check_consistent(const Result& r) {
  if (r.has_pose) {
    REQUIRE((r.status == Status::ok || r.status == Status::low_confidence ||
             r.status == Status::ambiguous || r.status == Status::scales_differ));
    REQUIRE(is_rigid(r.T_target_source));
    REQUIRE(is_rigid(r.T_target_source_coarse));
    REQUIRE(std::isfinite(r.rmse));
    REQUIRE((r.overlap >= 0 && r.overlap <= 1));
  } else {
    REQUIRE((r.status != Status::ok && r.status != Status::low_confidence));
    REQUIRE(r.T_target_source == identity_pose);
    REQUIRE(r.T_target_source_coarse == identity_pose);
    REQUIRE(std::isnan(r.confidence));
  }
}

struct Fixture {
  Random random{31};
  Registrar registrar{random_model().build(), {.mode = Mode::paper}};
  Points good = shape(100, random);

  Status both_ways(const Points& bad) {
    const Status status = registrar.align(bad, good).status;
    check_consistent(registrar.align(bad, good));
    const Result& swapped = registrar.align(good, bad);
    check_consistent(swapped);
    REQUIRE(swapped.status == status);
    REQUIRE(registrar.align(good, good).status == Status::ok);  // nothing is left behind
    return status;
  }
};

TEST_CASE_METHOD(Fixture, "too few points") {
  REQUIRE(both_ways({}) == Status::too_few_points);
  for (const std::size_t count : {1u, 2u, 3u, 23u}) {
    REQUIRE(both_ways(shape(count, random)) == Status::too_few_points);
  }
  REQUIRE(both_ways(shape(24, random)) == Status::ok);
  const Result& none = registrar.align({static_cast<const float*>(nullptr), 100}, good);
  REQUIRE(none.status == Status::too_few_points);
  REQUIRE(none.points_source == 0);
}

TEST_CASE("the fewest points follow from the hyper-parameters") {
  const auto fewest = [](Widths w) { return random_model(w).build().min_points(); };
  REQUIRE(fewest({}) == 24);
  REQUIRE(fewest({.neighbours = 64}) == 64);
  REQUIRE(fewest({.keep_divisor = 20}) == 60);
  Random random(32);
  Registrar registrar(random_model({.neighbours = 64, .keep_divisor = 20}).build(),
                      {.mode = Mode::coarse});
  REQUIRE(registrar.align(shape(63, random), shape(64, random)).status == Status::too_few_points);
  REQUIRE(registrar.align(shape(64, random), shape(64, random)).status == Status::ok);
}

TEST_CASE_METHOD(Fixture, "a coordinate that is not a usable number, anywhere") {
  for (const double bad : {nan, -nan, inf, -inf, 2e300, -1.7e308}) {
    for (const std::size_t at : {std::size_t{0}, std::size_t{50}, std::size_t{99}}) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Points cloud = good;
        cloud[at][axis] = bad;
        REQUIRE(both_ways(cloud) == Status::not_finite);
      }
    }
  }
  Points large = shape(2000, random);  // also where subsampling would not look
  for (std::size_t i = 0; i < large.size(); i += 97) {
    Points cloud = large;
    cloud[i][1] = nan;
    REQUIRE(registrar.align(cloud, good).status == Status::not_finite);
  }
}

TEST_CASE_METHOD(Fixture, "what is not a usable number is left out on request") {
  Registrar dropping(random_model().build(), {.mode = Mode::paper, .drop_non_finite = true});
  const Points source = shape(90, random);
  const Pose expected = dropping.align(source, good).T_target_source;
  for (const double bad : {nan, inf, -inf, 2e300}) {
    Points spoilt = source;
    spoilt.insert(spoilt.begin() + 40, {0.1, bad, 0.2});
    spoilt.push_back({bad, 0, 0});
    const Result& r = dropping.align(spoilt, good);
    REQUIRE(r.T_target_source == expected);
    REQUIRE((r.dropped_source == 2 && r.dropped_target == 0 && r.points_source == 90));
    REQUIRE(dropping.align(good, spoilt).dropped_target == 2);
  }
  const Points none(90, {nan, nan, nan});
  REQUIRE(dropping.align(none, good).status == Status::too_few_points);
  REQUIRE(dropping.align(good, good).dropped_source == 0);
}

TEST_CASE_METHOD(Fixture, "clouds of very different sizes are said to be") {
  for (const double ratio : {1.0, 2.9, 3.1, 1e3, 1e-3}) {
    const Points other = moved(good, Eigen::Isometry3d::Identity(), ratio);
    const bool far = std::max(ratio, 1 / ratio) > 3;
    const Result& r = registrar.align(good, other);
    check_consistent(r);
    if (r.has_pose) REQUIRE((r.status == Status::scales_differ) == far);
  }
}

TEST_CASE_METHOD(Fixture, "points that coincide") {
  REQUIRE(both_ways(Points(100, {0, 0, 0})) == Status::degenerate);
  REQUIRE(both_ways(Points(100, {1e5, -3, 7})) == Status::degenerate);
  REQUIRE(both_ways(Points(100, {0.1, 0.2, 0.3})) == Status::degenerate);
  Points nearly(100, {1e6, 1e6, 1e6});
  nearly[7][0] += 1e-7;
  REQUIRE(both_ways(nearly) == Status::degenerate);
  REQUIRE(both_ways(Points(100, {1e300, 1e300, -1e300})) == Status::degenerate);
}

TEST_CASE_METHOD(Fixture, "points on a line determine no rotation") {
  const Eigen::Vector3d directions[] = {{1, 0, 0}, {1, 2, 3}, {-0.3, 0.77, 0.1}};
  for (const Eigen::Vector3d& direction : directions) {
    for (const double offset : {0.0, 1.0, 50.0}) {
      Points line(100);
      for (auto& p : line) {
        const double t = random.normal();
        for (std::size_t a = 0; a < 3; ++a) p[a] = offset + t * direction(static_cast<int>(a));
      }
      CAPTURE(offset, direction.transpose());
      REQUIRE(both_ways(line) == Status::degenerate);
    }
  }
}

TEST_CASE_METHOD(Fixture, "flat clouds, duplicates and two clusters are registered") {
  Points flat = good;
  for (auto& p : flat) p[2] = 4;
  REQUIRE(both_ways(flat) == Status::ok);
  Points duplicated = good;
  duplicated.insert(duplicated.end(), good.begin(), good.end());
  REQUIRE(both_ways(duplicated) == Status::ok);
  Points clusters = good;
  for (std::size_t i = 0; i < 50; ++i) clusters[i][0] += 1000;
  REQUIRE(both_ways(clusters) == Status::scales_differ);
  Points all_twice(good.begin(), good.begin() + 20);
  for (int i = 0; i < 4; ++i) all_twice.insert(all_twice.end(), good.begin(), good.begin() + 20);
  const Result& r = registrar.align(all_twice, all_twice);  // median spacing 0
  REQUIRE(r.status == Status::ok);
  REQUIRE(r.inlier_distance == 0);
  check_consistent(r);
}

TEST_CASE_METHOD(Fixture, "the ends of the number range") {
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  for (const double unit : {1e-320, 1e-310, 1e-160, 1e160, 1e300}) {
    for (const double other : {1e-320, 1e-30, 1.0, 1e30, 1e300}) {
      const Result& r = registrar.align(moved(good, still, unit), moved(good, still, other));
      CAPTURE(unit, other, to_string(r.status));
      check_consistent(r);
    }
  }
  Points far = moved(good, still, 1e-3);
  for (auto& p : far) p[0] += 1e9;  // digits left: 1e-7 of the size 1e-3
  check_consistent(registrar.align(far, good));
}

TEST_CASE("coordinates taken as given may leave the range of float32") {
  Random random(33);
  Registrar registrar(random_model({.rms_radius = 0}).build());
  const Points good = shape(100, random);
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  for (const double unit : {1e16, 1e20, 1e40, 1e300}) {
    const Result& r = registrar.align(good, moved(good, still, unit));
    REQUIRE(r.status == Status::degenerate);
    check_consistent(r);
  }
  for (const double unit : {1e-300, 1e-45, 1e-40, 1e-30, 1e-20, 1e-10, 1e10, 1e14}) {
    CAPTURE(unit);
    check_consistent(registrar.align(good, moved(good, still, unit)));
    check_consistent(registrar.align(moved(good, still, unit), moved(good, still, unit)));
  }
}

TEST_CASE("a network that overflows breaks nothing") {
  Random random(35);
  const Points source = shape(300, random);
  const Points target = moved(shape(200, random), random_motion(random, 1));
  for (const float factor : {1e4f, 1e10f, 1e20f, 1e34f}) {
    for (const std::string prefix : {"encoder.", "local.", "fine.", ""}) {
      ModelDraft draft = random_model();
      for (auto& [name, tensor] : draft.tensors) {
        if (!name.starts_with(prefix)) continue;
        for (float& v : tensor.values) v *= factor;
      }
      for (const Mode mode : {Mode::coarse, Mode::paper, Mode::verified}) {
        Registrar registrar(draft.build(), {.mode = mode, .threads = 1, .record_stages = true});
        CAPTURE(factor, prefix, to_string(mode));
        check_consistent(registrar.align(source, target));
      }
    }
  }
}

TEST_CASE_METHOD(Fixture, "random nonsense never breaks the promise") {
  std::mt19937_64 bits(34);
  for (int trial = 0; trial < 300; ++trial) {
    Points cloud(24 + bits() % 100);
    const auto kind = bits() % 4;
    for (auto& p : cloud) {
      for (double& v : p) {
        const std::uint64_t b = bits();
        switch (kind) {
          case 0:
            std::memcpy(&v, &b, 8);
            break;  // any bit pattern
          case 1:
            v = std::ldexp(random.normal(), static_cast<int>(b % 1900) - 950);
            break;
          case 2:
            v = static_cast<double>(b % 3);
            break;  // a tiny lattice
          default:
            v = std::ldexp(1.0, -static_cast<int>(b % 60));
            break;
        }
      }
    }
    CAPTURE(trial, kind);
    check_consistent(registrar.align(cloud, good));
    check_consistent(registrar.align(cloud, cloud));
  }
}

TEST_CASE_METHOD(Fixture, "counts that differ wildly, up to ten million") {
  std::vector<std::array<float, 3>> many(10'000'000);
  std::uint32_t state = 1;
  for (auto& p : many) {
    for (float& v : p) {
      state = state * 1664525u + 1013904223u;
      v = static_cast<float>(state >> 8) * 0x1p-24f;
    }
  }
  const Result& r = registrar.align(many, shape(24, random));
  REQUIRE(r.status == Status::ok);
  REQUIRE(r.points_source == 1024);
  REQUIRE(r.points_target == 24);
  check_consistent(r);
  many[9'999'999][2] = std::numeric_limits<float>::quiet_NaN();
  REQUIRE(registrar.align(many, good).status == Status::not_finite);
}

TEST_CASE_METHOD(Fixture, "subsampling takes distinct input points, by the seed alone") {
  const Points cloud = shape(1000, random);
  const auto sample = [&](std::uint64_t seed) {
    Registrar r(random_model({.rms_radius = 0}).build(),
                {.max_points = 100, .seed = seed, .record_stages = true});
    REQUIRE(r.align(cloud, good).points_source == 100);
    std::vector<double> values = stage(r, "source.points").values;
    Points points(100);
    std::memcpy(points.data(), values.data(), values.size() * sizeof(double));
    return points;
  };
  const Points first = sample(1);
  REQUIRE(first == sample(1));
  REQUIRE(first != sample(2));
  // Coordinates as given but centred: differences between sample points are those of input points.
  std::vector<std::size_t> where;
  const std::array<double, 3> origin = first[0];
  for (std::size_t base = 0; base < cloud.size() && where.size() < 100; ++base) {
    where.clear();
    std::size_t next = base;
    for (const auto& p : first) {
      while (next < cloud.size()) {
        double miss = 0;
        for (std::size_t a = 0; a < 3; ++a) {
          miss += std::abs((cloud[next][a] - cloud[base][a]) - (p[a] - origin[a]));
        }
        if (miss < 1e-6) break;
        ++next;
      }
      if (next == cloud.size()) break;
      where.push_back(next++);  // strictly ascending: distinct, and in the order of the input
    }
  }
  REQUIRE(where.size() == 100);
  const std::size_t in_first_half = static_cast<std::size_t>(
      std::count_if(where.begin(), where.end(), [](auto i) { return i < 500; }));
  REQUIRE(in_first_half > 30);
  REQUIRE(in_first_half < 70);
}

}  // namespace
}  // namespace vnreg::test
