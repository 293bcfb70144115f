// Architecture `vnreg`: what its files must hold, and what its descriptors must not depend on.
#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "clouds.hpp"
#include "random_descriptor_model.hpp"

namespace vnreg::test {
namespace {

using Stages = std::map<std::string, std::vector<double>>;

/// Loads the draft, which must fail with this code and a field that contains `field`.
void refused(const ModelDraft& draft, ErrorCode code, const std::string& field) {
  try {
    draft.build();
  } catch (const Error& e) {
    CAPTURE(e.what());
    REQUIRE(e.code() == code);
    REQUIRE(e.field().find(field) != std::string::npos);
    return;
  }
  FAIL("a model was accepted that must be refused for " << field);
}

Stages stages_of(Registrar& registrar, const Points& source, const Points& target) {
  REQUIRE(registrar.align(source, target).has_pose);
  Stages stages;
  for (const Stage& s : registrar.stages()) stages[s.name] = s.values;
  return stages;
}

double difference(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double difference = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference += (a[i] - b[i]) * (a[i] - b[i]);
    size += b[i] * b[i];
  }
  REQUIRE(std::isfinite(difference));
  REQUIRE(size > 0);
  return std::sqrt(difference / size);
}

TEST_CASE("a vnreg model needs every tensor, with its exact shape, and no other") {
  const ModelDraft good = random_descriptor_model();
  REQUIRE_NOTHROW(good.build());
  for (const auto& [name, tensor] : good.tensors) {
    CAPTURE(name);
    ModelDraft missing = good;
    missing.tensors.erase(name);
    refused(missing, ErrorCode::missing_tensor, name);

    ModelDraft renamed = good;
    renamed.tensors[name + "x"] = tensor;
    refused(renamed, ErrorCode::wrong_architecture, name + "x");

    ModelDraft longer = good;
    StoredTensor& t = longer.tensors[name];
    t.shape[0] += 1;
    t.values.resize(t.values.size() / (t.shape[0] - 1) * t.shape[0]);
    refused(longer, ErrorCode::missing_tensor, name);
  }
}

TEST_CASE("a vnreg model needs every hyper-parameter, within its range") {
  const ModelDraft good = random_descriptor_model();
  for (const auto& [key, value] : good.metadata) {
    CAPTURE(key);
    ModelDraft missing = good;
    missing.metadata.erase(key);
    refused(missing, ErrorCode::wrong_architecture, key);
    ModelDraft other_type = good;
    other_type.metadata[key] = true;
    refused(other_type, ErrorCode::wrong_architecture, key);
    if (std::holds_alternative<std::string>(value)) continue;
    const bool count = std::holds_alternative<std::uint64_t>(value);
    ModelDraft small = good, large = good;
    small.metadata[key] = count ? model_format::Value(std::uint64_t{0}) : model_format::Value(0.0);
    refused(small, ErrorCode::wrong_architecture, key);
    large.metadata[key] =
        count ? model_format::Value(std::uint64_t{100000}) : model_format::Value(1e6);
    refused(large, ErrorCode::wrong_architecture, key);
  }
  ModelDraft unknown = good;
  unknown.metadata["arch"] = std::string("other");
  refused(unknown, ErrorCode::wrong_architecture, "arch");
}

TEST_CASE("a vnreg model has no mode paper") {
  const Model model = random_descriptor_model().build();
  REQUIRE_THROWS_AS(Registrar(model, {.mode = Mode::paper}), Error);
  REQUIRE_NOTHROW(Registrar(model, {.mode = Mode::coarse}));
  REQUIRE_NOTHROW(Registrar(model, {.mode = Mode::verified}));
}

TEST_CASE("the number of threads changes no bit of any descriptor") {
  const Model model = random_descriptor_model({.encoded = 300}).build();
  Random random(51);
  for (const std::size_t count : {24u, 333u, 1024u}) {
    const Points source = shape(count, random), target = shape(count + 9, random);
    Registrar one(model, {.mode = Mode::coarse, .threads = 1, .record_stages = true});
    const Stages expected = stages_of(one, source, target);
    REQUIRE(expected.size() == 2 * 18 + 1);
    for (const int threads : {2, 3, 8}) {
      Registrar several(model, {.mode = Mode::coarse, .threads = threads, .record_stages = true});
      CAPTURE(count, threads);
      REQUIRE(stages_of(several, source, target) == expected);
    }
  }
}

TEST_CASE("encoded points are a random choice of so many, each once, that the seed decides") {
  const Model model = random_descriptor_model({.encoded = 100}).build();
  Random random(52);
  const Points source = shape(700, random), target = shape(60, random);
  const auto encoded = [&](std::uint64_t seed, const char* side) {
    Registrar registrar(model, {.mode = Mode::coarse, .seed = seed, .record_stages = true});
    const std::vector<double> all =
        stages_of(registrar, source, target)[std::string(side) + ".encoded"];
    const std::set<double> unique(all.begin(), all.end());
    REQUIRE(unique.size() == all.size());
    return unique;
  };
  const std::set<double> first = encoded(1, "source");
  REQUIRE(first.size() == 100);
  REQUIRE(*first.rbegin() < 700);
  REQUIRE(first == encoded(1, "source"));
  REQUIRE(first != encoded(2, "source"));
  REQUIRE(encoded(1, "target").size() == 60);
}

TEST_CASE("descriptors do not change with the pose of the cloud") {
  const Model model = random_descriptor_model({.encoded = 4096}).build();
  Random random(53);
  for (const std::size_t count : {64u, 333u, 1000u}) {
    const Points source = shape(count, random);
    const Points target = moved(source, random_motion(random, 3));
    Registrar registrar(model, {.mode = Mode::coarse, .record_stages = true});
    Stages stages = stages_of(registrar, source, target);
    // The encoded points come in a spatial order, which turns too: sorted by index here.
    const auto sorted = [&](const std::string& side, const std::string& name) {
      const std::vector<double>& order = stages[side + ".encoded"];
      const std::vector<double>& values = stages[side + "." + name];
      const std::size_t width = values.size() / order.size();
      std::vector<double> result(values.size());
      for (std::size_t i = 0; i < order.size(); ++i) {
        std::copy_n(&values[i * width], width, &result[static_cast<std::size_t>(order[i]) * width]);
      }
      return result;
    };
    for (const char* name : {"descriptor.local", "descriptor.context", "significance", "overlap"}) {
      CAPTURE(count, name);
      REQUIRE(difference(sorted("target", name), sorted("source", name)) < 2e-4);
    }
  }
}

}  // namespace
}  // namespace vnreg::test
