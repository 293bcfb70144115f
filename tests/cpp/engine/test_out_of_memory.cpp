// Memory that runs out at any allocation of a construction: std::bad_alloc, nothing leaked, nothing
// changed.
#include <catch2/catch.hpp>
#include <new>

#include "clouds.hpp"
#include "random_descriptor_model.hpp"
#include "vnreg/vnreg.h"
#include "watched_heap.hpp"

namespace vnreg::test {
namespace {

/// Lets `make` fail at its first allocation, its second and so on, until it succeeds. Returns how
/// often it failed.
template <class Make>
long fail_everywhere(const Make& make) {
  make();  // what is made once in the life of a process is made now
  for (long count = 0;; ++count) {
    bool failed = false;
    const long before = heap::live();
    heap::fail_after(count);
    try {
      make();
    } catch (const std::bad_alloc&) {
      failed = true;
    }
    heap::fail_after(-1);
    const long after = heap::live();
    CAPTURE(count);
    REQUIRE(after == before);
    if (!failed) return count;
  }
}

ModelDraft paper_draft() {
  return random_model({.global = 4, .local = 4, .descriptor = 4, .pair = 4});
}
ModelDraft lean_draft() { return random_descriptor_model({.vectors = 4, .scalars = 4}); }

TEST_CASE("out of memory: loading a model") {
  for (const ModelDraft& draft : {paper_draft(), lean_draft()}) {
    const std::vector<std::byte> bytes = draft.bytes();
    REQUIRE(fail_everywhere([&] { Model::from_bytes(bytes); }) > 100);
  }
}

TEST_CASE("out of memory: a registrar of every mode, and a batch") {
  const Model fine = paper_draft().build();
  const Model lean = lean_draft().build();
  for (const Mode mode : {Mode::coarse, Mode::paper, Mode::verified}) {
    const Options options{.mode = mode, .threads = 1, .max_points = 64};
    REQUIRE(fail_everywhere([&] { Registrar(fine, options); }) > 10);
    if (mode == Mode::paper) continue;
    REQUIRE(fail_everywhere([&] { Registrar(lean, options); }) > 10);
    REQUIRE(fail_everywhere([&] { BatchRegistrar(lean, options); }) > 10);
  }
}

TEST_CASE("out of memory: a cloud that is prepared leaves its registrar as it was") {
  Random random(91);
  const Points source = shape(100, random), target = shape(100, random);
  Registrar registrar(lean_draft().build(), {.threads = 1, .max_points = 64});
  const Pose expected = registrar.align(source, target).T_target_source;
  const PreparedCloud good = registrar.prepare(target);
  REQUIRE(fail_everywhere([&] { registrar.prepare(source); }) > 5);
  const Pose with_points = registrar.align(source, target).T_target_source;
  REQUIRE(with_points == expected);
  const Status prepared = registrar.align(source, good).status;
  REQUIRE(prepared != Status::degenerate);
}

TEST_CASE("out of memory: the free functions") {
  Random random(92);
  const Points source = shape(30, random), target = shape(30, random);
  const Options options{.mode = Mode::coarse, .threads = 1};
  REQUIRE(fail_everywhere([&] { align(source, target, options); }) > 10);
  const CloudPair pairs[] = {{source, target}};
  REQUIRE(fail_everywhere([&] { align_many(pairs, options); }) > 10);
}

TEST_CASE("out of memory: the C API says so and gives no handle") {
  const std::vector<std::byte> bytes = lean_draft().bytes();
  const auto create = [&] {
    vnreg_error error;
    vnreg_model* model = nullptr;
    vnreg_registrar* registrar = nullptr;
    vnreg_code code = vnreg_model_from_bytes(bytes.data(), bytes.size(), &model, &error);
    if (code == VNREG_OK) code = vnreg_registrar_create(model, nullptr, &registrar, &error);
    const bool has_both = model != nullptr && registrar != nullptr;
    vnreg_registrar_free(registrar);
    vnreg_model_free(model);
    if (code == VNREG_OUT_OF_MEMORY && !has_both) throw std::bad_alloc();
    if (code != VNREG_OK || !has_both) throw std::runtime_error("another code");
  };
  REQUIRE(fail_everywhere(create) > 100);
}

}  // namespace
}  // namespace vnreg::test
