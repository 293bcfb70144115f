// What the engine refuses to load, and what it says.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

/// Loads the draft, which must fail with this code and a field that contains `field`.
void refused(const ModelDraft& draft, ErrorCode code, const std::string& field) {
  try {
    draft.build();
  } catch (const Error& e) {
    CAPTURE(e.what());
    REQUIRE(e.code() == code);
    REQUIRE(e.field().find(field) != std::string::npos);
    REQUIRE(!e.expected().empty());
    REQUIRE(!e.got().empty());
    return;
  }
  FAIL("a model was accepted that must be refused for " << field);
}

TEST_CASE("every tensor is needed, with its exact shape, and no other") {
  for (const bool shared : {false, true}) {
    const ModelDraft good = random_model({.global = 5, .local = 12, .shared_direction = shared});
    REQUIRE_NOTHROW(good.build());
    REQUIRE(good.tensors.size() == (1 + 5 * 5 + 2) + (2 * 5 + 2 * 4 + 1 + 2) + (6 + 4 + 4 + 4));
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

      ModelDraft flat = good;
      flat.tensors[name].shape = {tensor.values.size(), 1};
      if (flat.tensors[name].shape != tensor.shape) {
        refused(flat, ErrorCode::missing_tensor, name);
      }
    }
  }
}

TEST_CASE("an ablation needs its own tensors and no others") {
  const ModelDraft shared = random_model();
  for (const bool encoder : {false, true}) {
    const ModelDraft good = random_model({.shared_encoder = encoder, .invariant_layer = !encoder});
    REQUIRE_NOTHROW(good.build());
    const std::string switched = encoder ? "invariant_layer" : "shared_encoder";
    ModelDraft full = good;
    full.metadata["ablation." + switched] = true;
    refused(full, encoder ? ErrorCode::missing_tensor : ErrorCode::wrong_architecture,
            encoder ? "local.invariant.0.fc" : "local.encoder.");
    ModelDraft number = good;
    number.metadata["ablation." + switched] = 1.0;
    refused(number, ErrorCode::wrong_architecture, "ablation." + switched);
    for (const auto& [name, tensor] : good.tensors) {
      if (shared.tensors.contains(name)) continue;
      CAPTURE(name);
      ModelDraft missing = good;
      missing.tensors.erase(name);
      refused(missing, ErrorCode::missing_tensor, name);
    }
  }
}

TEST_CASE("an identity shortcut has no tensor") {
  ModelDraft draft = random_model({.global = 8, .local = 16});
  REQUIRE(!draft.tensors.contains("local.network2.0.shortcut"));
  REQUIRE_NOTHROW(draft.build());
  draft.tensors["local.network2.0.shortcut"] = {{16, 16}, std::vector<float>(256)};
  refused(draft, ErrorCode::wrong_architecture, "local.network2.0.shortcut");
}

TEST_CASE("every hyper-parameter is needed, of its type and in its range") {
  const ModelDraft good = random_model();
  for (const auto& [key, value] : good.metadata) {
    ModelDraft missing = good;
    missing.metadata.erase(key);
    refused(missing, ErrorCode::wrong_architecture, key);
    ModelDraft other_type = good;
    if (std::holds_alternative<double>(value)) {
      other_type.metadata[key] = std::uint64_t{1};
    } else {
      other_type.metadata[key] = 1.0;
    }
    refused(other_type, ErrorCode::wrong_architecture, key);
  }
  const std::pair<const char*, std::uint64_t> outside[] = {{"channels.global", 3},
                                                           {"channels.global", 513},
                                                           {"channels.local", 0},
                                                           {"channels.local", 18},
                                                           {"channels.local", 516},
                                                           {"channels.descriptor", 0},
                                                           {"channels.descriptor", 513},
                                                           {"channels.pair", 0},
                                                           {"channels.pair", 513},
                                                           {"channels.significance.0", 0},
                                                           {"channels.significance.1", 513},
                                                           {"neighbours", 0},
                                                           {"neighbours", 65},
                                                           {"fine.iterations", 17},
                                                           {"fine.keep_divisor", 0},
                                                           {"fine.keep_divisor", 65},
                                                           {"input.points", 63},
                                                           {"input.points", 16385},
                                                           {"channels.global", ~std::uint64_t{0}}};
  for (const auto& [key, value] : outside) {
    ModelDraft draft = good;
    draft.metadata[key] = value;
    refused(draft, ErrorCode::wrong_architecture, key);
  }
  for (const double radius : {-1.0, 1e-4, 1.1e3}) {
    ModelDraft draft = good;
    draft.metadata["input.rms_radius"] = radius;
    refused(draft, ErrorCode::wrong_architecture, "input.rms_radius");
  }
  ModelDraft draft = good;
  draft.metadata["arch"] = std::string("golden");
  refused(draft, ErrorCode::wrong_architecture, "arch");
  for (const std::string& name : {std::string(), std::string(65, 'n')}) {
    draft = good;
    draft.metadata["name"] = name;
    refused(draft, ErrorCode::wrong_architecture, "name");
  }
  draft = random_model({.keep_divisor = 64});
  draft.metadata["input.points"] = std::uint64_t{128};  // fewer than 3 * 64
  refused(draft, ErrorCode::wrong_architecture, "input.points");
}

TEST_CASE("a calibration has all three numbers or none") {
  const char* keys[] = {"calibration.bias", "calibration.overlap", "calibration.residual"};
  for (int present = 1; present < 7; ++present) {
    ModelDraft draft = random_model();
    for (int i = 0; i < 3; ++i) {
      if ((present >> i & 1) != 0) draft.metadata[keys[i]] = 1.0;
    }
    refused(draft, ErrorCode::wrong_architecture, "calibration.");
  }
}

TEST_CASE("keys and metadata that only inform are allowed") {
  ModelDraft draft = random_model();
  draft.metadata["provenance.data"] = std::string("none: random weights");
  draft.metadata["future.key"] = std::uint64_t{7};
  const Model model = draft.build();
  REQUIRE(model.name() == "random");
  REQUIRE(model.points() == 1024);
  REQUIRE(model.min_points() == 24);
  draft.metadata["provenance.data"] = std::string(4097, 'p');
  refused(draft, ErrorCode::wrong_architecture, "provenance.data");
  draft.metadata["provenance.data"] = std::uint64_t{1};
  refused(draft, ErrorCode::wrong_architecture, "provenance.data");
}

TEST_CASE("damaged bytes are refused before the architecture is looked at") {
  std::vector<std::byte> bytes = random_model().bytes();
  bytes[bytes.size() / 2] ^= std::byte{1};
  REQUIRE_THROWS_AS(Model::from_bytes(bytes), Error);
  REQUIRE_THROWS_AS(Model::from_bytes({}), Error);
  bytes.resize(100);
  REQUIRE_THROWS_AS(Model::from_bytes(bytes), Error);
}

TEST_CASE("from a file, from memory: the same model; no file, no model") {
  const ModelDraft draft = random_model();
  const std::vector<std::byte> bytes = draft.bytes();
  const auto path = std::filesystem::temp_directory_path() / "vnreg_test_model.vnr";
  {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }
  Random random(61);
  const Points source = shape(100, random);
  const Points target = shape(100, random);
  Registrar from_file(Model::load(path.string()), {.mode = Mode::paper});
  Registrar from_memory(draft.build(), {.mode = Mode::paper});
  REQUIRE(from_file.align(source, target).T_target_source ==
          from_memory.align(source, target).T_target_source);
  std::filesystem::remove(path);
  try {
    Model::load(path.string());
    FAIL("a model was loaded from nothing");
  } catch (const Error& e) {
    REQUIRE(e.code() == ErrorCode::file_unreadable);
  }
}

TEST_CASE("bytes at any address, released after loading") {
  Random random(62);
  const Points cloud = shape(100, random);
  Registrar expected(random_model().build(), {.mode = Mode::paper});
  const Pose pose = expected.align(cloud, cloud).T_target_source;
  for (const std::size_t shift : {1u, 4u, 63u}) {
    const std::vector<std::byte> bytes = random_model().bytes();
    std::vector<std::byte> shifted(shift);
    shifted.insert(shifted.end(), bytes.begin(), bytes.end());
    const Model model = Model::from_bytes(std::span(shifted).subspan(shift));
    std::fill(shifted.begin(), shifted.end(), std::byte{0xff});
    REQUIRE(Registrar(model, {.mode = Mode::paper}).align(cloud, cloud).T_target_source == pose);
  }
}

}  // namespace
}  // namespace vnreg::test
