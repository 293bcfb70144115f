// Mode verified: the confidence is the calibration's logistic model of the evidence.
#include <catch2/catch.hpp>
#include <limits>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

const std::string prefix = "calibration.verified.";

ModelDraft calibrated(double bias) {
  ModelDraft draft = random_model({.global = 8, .local = 8});
  draft.metadata[prefix + "bias"] = bias;
  double weight = 0.7;  // another one for each name
  for (const std::string_view name : Evidence::names) {
    draft.metadata[prefix + std::string(name)] = weight;
    weight *= -1.3;
  }
  return draft;
}

double logit(double bias, const Evidence& evidence) {
  double sum = bias;
  double weight = 0.7;
  for (const double value : evidence.values()) {
    sum += weight * value;
    weight *= -1.3;
  }
  return sum;
}

void refused(const ModelDraft& draft, ErrorCode code, const std::string& key) {
  try {
    draft.build();
  } catch (const Error& e) {
    REQUIRE(e.code() == code);
    REQUIRE(e.field().find(key) != std::string::npos);
    return;
  }
  FAIL("accepted: " << key);
}

/// Half a turn about z maps it onto itself.
Points symmetric_body(Random& random) {
  Points points = shape(150, random);
  for (auto& p : points) p[1] += 0.5;
  const std::size_t half = points.size();
  for (std::size_t i = 0; i < half; ++i) {
    points.push_back({-points[i][0], -points[i][1], points[i][2]});
  }
  return points;
}

TEST_CASE("confidence follows the calibration of the evidence") {
  Random random(61);
  const Points source = shape(300, random);
  const Points target = moved(shape(250, random), random_motion(random, 1));
  for (const double bias : {-1000.0, -3.0, 0.0, 3.0, 1000.0}) {
    Registrar registrar(calibrated(bias).build(), {.threads = 1});
    const Result& r = registrar.align(source, target);
    CAPTURE(bias);
    REQUIRE(r.has_pose);
    REQUIRE(r.confidence == Approx(1 / (1 + std::exp(-logit(bias, r.evidence)))).margin(1e-12));
    if (r.status != Status::ambiguous) {
      REQUIRE(r.status == (r.confidence < 0.5 ? Status::low_confidence : Status::ok));
    }
  }
}

TEST_CASE("evidence is finite, and shares are shares") {
  const int seed = GENERATE(range(0, 10));
  Random random(static_cast<std::uint64_t>(620 + seed));
  Registrar registrar(random_model({.global = 8, .local = 8}).build(), {.threads = 1});
  const Points target = moved(shape(200, random), random_motion(random, 1));
  const Points source = seed % 2 == 0 ? shape(150, random) : target;
  const Result& r = registrar.align(source, target);
  REQUIRE(r.has_pose);
  const Evidence& e = r.evidence;
  for (const double value : e.values()) REQUIRE(std::isfinite(value));
  REQUIRE(e.score == r.score);
  for (const double share : {e.margin, e.covered, e.contradicted, e.beyond}) {
    REQUIRE((share >= 0 && share <= 1));
  }
  REQUIRE(e.covered + e.contradicted + e.beyond == Approx(1).margin(1e-6));
  REQUIRE((e.residual >= 0 && e.noise >= 0));
  if (source == target) REQUIRE(e.residual < 0.05);
}

TEST_CASE("where another pose fits as well, that is said first") {
  Random random(63);
  const Points body = symmetric_body(random);
  for (const double bias : {-1000.0, 1000.0}) {
    Registrar registrar(calibrated(bias).build(), {.threads = 1});
    const Result& r = registrar.align(body, moved(body, random_motion(random, 1)));
    REQUIRE(r.status == Status::ambiguous);
    REQUIRE(!r.alternatives.empty());
    REQUIRE(r.evidence.margin < 0.05);
    REQUIRE((r.confidence < 0.5) == (bias < 0));
  }
}

TEST_CASE("without a calibration, a pose or the mode there is no confidence") {
  Random random(64);
  const Points cloud = shape(200, random);
  Registrar plain(random_model({.global = 8, .local = 8}).build(), {.threads = 1});
  REQUIRE(std::isnan(plain.align(cloud, cloud).confidence));
  REQUIRE(!std::isnan(plain.align(cloud, cloud).evidence.score));
  Registrar registrar(calibrated(0).build(), {.threads = 1});
  const Result& none = registrar.align(cloud, Points{});
  REQUIRE(std::isnan(none.confidence));
  for (const double value : none.evidence.values()) REQUIRE(std::isnan(value));
  Registrar paper(calibrated(0).build(), {.mode = Mode::paper, .threads = 1});
  const Result& other = paper.align(cloud, cloud);
  REQUIRE(std::isnan(other.confidence));
  for (const double value : other.evidence.values()) REQUIRE(std::isnan(value));
}

TEST_CASE("a calibration of mode verified has all of its numbers or none, and they are finite") {
  for (const std::string_view name : Evidence::names) {
    ModelDraft draft = calibrated(1);
    draft.metadata.erase(prefix + std::string(name));
    refused(draft, ErrorCode::wrong_architecture, prefix + std::string(name));
    for (const double value :
         {std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()}) {
      draft.metadata[prefix + std::string(name)] = value;
      refused(draft, ErrorCode::corrupt_model, prefix + std::string(name));
    }
  }
  ModelDraft draft = calibrated(1);
  draft.metadata.erase(prefix + "bias");
  refused(draft, ErrorCode::wrong_architecture, prefix + "bias");
  draft = random_model();
  draft.metadata[prefix + "bias"] = 1.0;
  refused(draft, ErrorCode::wrong_architecture, prefix);
}

TEST_CASE("the covariance is inflated by a sensible number") {
  for (const double value : {0.0, -1.0, 1e4}) {
    ModelDraft draft = random_model();
    draft.metadata[prefix + "covariance"] = value;
    refused(draft, ErrorCode::wrong_architecture, prefix + "covariance");
  }
}

}  // namespace
}  // namespace vnreg::test
