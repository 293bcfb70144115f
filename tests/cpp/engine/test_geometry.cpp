// What must hold for any weights: features turn with the cloud, descriptors do not change, the
// order of points does not matter, and a clean pair is aligned exactly.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

const Widths architectures[] = {
    {},
    {.global = 8, .local = 8, .shared_direction = true},
    {.global = 32, .local = 64, .neighbours = 20},
    {.global = 47, .local = 20, .shared_direction = true, .rms_radius = 0},
    {.global = 48, .local = 48, .descriptor = 64, .pair = 32, .neighbours = 20},
};

double largest(const std::vector<double>& values) {
  double result = 0;
  for (const double v : values) result = std::max(result, std::abs(v));
  return result;
}

/// Norms, so that a few neighbourhoods whose last neighbours tie up to rounding do not matter.
double relative_error(const std::vector<double>& got, const std::vector<double>& expected) {
  REQUIRE(got.size() == expected.size());
  double difference = 0;
  double norm = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    difference += (got[i] - expected[i]) * (got[i] - expected[i]);
    norm += expected[i] * expected[i];
  }
  return std::sqrt(difference / norm);
}

std::vector<double> rotated(const std::vector<double>& vectors, const Eigen::Matrix3d& r) {
  std::vector<double> result(vectors.size());
  for (std::size_t i = 0; i < vectors.size(); i += 3) {
    const Eigen::Vector3d turned = r * Eigen::Vector3d(&vectors[i]);
    std::copy_n(turned.data(), 3, &result[i]);
  }
  return result;
}

TEST_CASE("the global feature turns with the cloud, wherever the cloud is") {
  Random random(11);
  for (const Widths& widths : architectures) {
    Registrar registrar(random_model(widths, 12).build(),
                        {.mode = Mode::paper, .threads = 1, .record_stages = true});
    const Points cloud = shape(400, random);
    for (const double reach : {0.0, 1.0, 10.0, 100.0}) {
      const Eigen::Isometry3d motion = random_motion(random, reach);
      REQUIRE(registrar.align(cloud, moved(cloud, motion)).has_pose);
      CAPTURE(widths.global, widths.local, reach);
      for (const char* name :
           {"network0.block0", "network0.block2", "network1.block0", "global", "network2.block1"}) {
        CAPTURE(name);
        const std::string suffix(name);
        REQUIRE(relative_error(
                    stage(registrar, "target." + suffix).values,
                    rotated(stage(registrar, "source." + suffix).values, motion.linear())) < 1e-4);
      }
    }
  }
}

TEST_CASE("descriptors and significances do not change with the pose") {
  Random random(13);
  for (const Widths& widths : architectures) {
    Registrar registrar(random_model(widths, 14).build(),
                        {.mode = Mode::paper, .threads = 1, .record_stages = true});
    const Points cloud = shape(400, random);
    for (const double reach : {1.0, 100.0}) {
      registrar.align(cloud, moved(cloud, random_motion(random, reach)));
      for (const char* name : {"descriptor", "significance"}) {
        const std::vector<double>& source = stage(registrar, std::string("source.") + name).values;
        const std::vector<double>& target = stage(registrar, std::string("target.") + name).values;
        CAPTURE(widths.global, reach, name);
        REQUIRE(largest(source) > 1e-3);
        REQUIRE(relative_error(target, source) < 1e-4);
      }
    }
  }
}

TEST_CASE("the order of the points does not matter") {
  Random random(15);
  Registrar registrar(random_model({}, 16).build(),
                      {.mode = Mode::paper, .threads = 1, .record_stages = true});
  const Points cloud = shape(333, random);
  std::vector<std::size_t> order(cloud.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random.engine());
  Points shuffled;
  for (const std::size_t i : order) shuffled.push_back(cloud[i]);
  registrar.align(cloud, shuffled);
  REQUIRE(relative_error(stage(registrar, "target.global").values,
                         stage(registrar, "source.global").values) < 1e-5);
  const std::vector<double>& source = stage(registrar, "source.descriptor").values;
  const std::vector<double>& target = stage(registrar, "target.descriptor").values;
  const std::size_t channels = source.size() / cloud.size();
  std::vector<double> expected;
  for (const std::size_t i : order) {
    const auto row = source.begin() + static_cast<std::ptrdiff_t>(i * channels);
    expected.insert(expected.end(), row, row + static_cast<std::ptrdiff_t>(channels));
  }
  REQUIRE(relative_error(target, expected) < 1e-5);
}

TEST_CASE("a clean pair is aligned exactly by the coarse register, with any weights") {
  Random random(17);
  for (const Widths& widths : architectures) {
    Registrar registrar(random_model(widths, 18).build(), {.mode = Mode::coarse});
    for (const double reach : {0.5, 100.0}) {
      const Points source = shape(500, random);
      const Eigen::Isometry3d truth = random_motion(random, reach);
      Points target = moved(source, truth);
      std::shuffle(target.begin(), target.end(), random.engine());
      const Result& result = registrar.align(source, target);
      CAPTURE(widths.global, reach);
      REQUIRE(result.status == Status::ok);
      const Eigen::Isometry3d pose = motion_of(result.T_target_source);
      REQUIRE(rotation_error_deg(pose, truth) < 0.05);
      const Eigen::Vector3d probe(source[0].data());
      REQUIRE((pose * probe - truth * probe).norm() < 1e-3);
      REQUIRE(result.overlap == 1.0);
      REQUIRE(result.rmse < 1e-3);
      REQUIRE(result.T_target_source == result.T_target_source_coarse);
    }
  }
}

TEST_CASE("any unit of length gives the same rotation and a translation in that unit") {
  Random random(19);
  Registrar registrar(random_model({}, 20).build());
  const Points source = shape(300, random);
  const Points target = moved(shape(310, random), random_motion(random, 2));
  const Result reference = registrar.align(source, target);
  REQUIRE(reference.has_pose);
  const Eigen::Isometry3d expected = motion_of(reference.T_target_source);
  for (const double unit : {1e-3, 1e3, 1e-100, 1e100, 1e-300, 1e299}) {
    const Eigen::Isometry3d identity = Eigen::Isometry3d::Identity();
    const Result& result =
        registrar.align(moved(source, identity, unit), moved(target, identity, unit));
    CAPTURE(unit);
    REQUIRE(result.status == Status::ok);
    const Eigen::Isometry3d pose = motion_of(result.T_target_source);
    REQUIRE(rotation_error_deg(pose, expected) < 1e-3);
    REQUIRE((pose.translation() / unit - expected.translation()).norm() < 1e-4);
    REQUIRE(result.rmse / unit == Approx(reference.rmse).epsilon(1e-3));
    REQUIRE(result.inlier_distance / unit == Approx(reference.inlier_distance).epsilon(1e-3));
  }
}

TEST_CASE("float32 and float64 input, packed or strided, agree") {
  Random random(21);
  Registrar registrar(random_model({}, 22).build());
  const Points source64 = shape(200, random);
  std::vector<std::array<float, 3>> source32;
  Points rounded;
  struct Record {
    char tag;
    float xyz[3];
    double other;
  };
  std::vector<Record> records;
  std::vector<unsigned char> unaligned(200 * 13 + 1);
  for (const auto& p : source64) {
    const std::array<float, 3> f{static_cast<float>(p[0]), static_cast<float>(p[1]),
                                 static_cast<float>(p[2])};
    std::memcpy(unaligned.data() + 1 + 13 * source32.size(), f.data(), sizeof(f));
    source32.push_back(f);
    rounded.push_back(
        {static_cast<double>(f[0]), static_cast<double>(f[1]), static_cast<double>(f[2])});
    records.push_back({'r', {f[0], f[1], f[2]}, 1e308});
  }
  const Points target = moved(source64, random_motion(random, 1));
  const Pose expected = registrar.align(rounded, target).T_target_source;
  REQUIRE(registrar.align(source32, target).T_target_source == expected);
  REQUIRE(registrar.align({records[0].xyz, 200, sizeof(Record)}, target).T_target_source ==
          expected);
  const void* odd_address = unaligned.data() + 1;
  REQUIRE(
      registrar.align({static_cast<const float*>(odd_address), 200, 13}, target).T_target_source ==
      expected);
}

}  // namespace
}  // namespace vnreg::test
