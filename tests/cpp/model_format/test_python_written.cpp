// The file that tests/python/model_format/tiny_file.py writes, value by value.
#include <cmath>
#include <limits>

#include "refusals.hpp"

namespace vnreg::model_format::test {
namespace {

const std::string path = std::string(VNREG_TEST_DATA_DIR) + "/model_format/tiny.vnr";

template <typename Scalar>
std::vector<Scalar> values(std::span<const Scalar> elements) {
  return {elements.begin(), elements.end()};
}

TEST_CASE("python: the metadata of the written file") {
  const AlignedBytes bytes = read_file(path);
  const ModelFile file = ModelFile::parse(bytes.span());
  const ModelFile::Metadata expected{
      {"arch", std::string("golden")},
      {"model.name", std::string("tr\xc3\xa8s petit \xf0\x9f\x90\xb0")},
      {"model.crc", std::uint64_t{0xe3069283}},
      {"limits.u64", std::numeric_limits<std::uint64_t>::max()},
      {"limits.f64", std::numeric_limits<double>::lowest()},
      {"limits.tiny", std::numeric_limits<double>::denorm_min()},
      {"limits.third", 1.0 / 3.0},
      {"flag.off", false},
      {"flag.on", true},
      {"provenance.empty", std::string()}};
  CHECK(file.metadata() == expected);
}

TEST_CASE("python: the tensors of the written file") {
  const AlignedBytes bytes = read_file(path);
  const ModelFile file = ModelFile::parse(bytes.span());
  const auto tensor = [&](const char* name) { return file.tensors().find(name)->second; };
  REQUIRE(file.tensors().size() == 6);

  std::vector<float> source(21);
  std::vector<double> target(21);
  for (std::size_t i = 0; i < 21; ++i) source[i] = static_cast<float>(i) / 8 - 1;
  for (std::size_t i = 0; i < 21; ++i) target[i] = static_cast<double>(i) / 3;
  CHECK(values(file.tensor_f32("input.source", {7, 3})) == source);
  CHECK(tensor("input.target").shape == std::vector<std::size_t>{7, 3});
  CHECK(values(tensor("input.target").f64()) == target);

  std::vector<double> pose(16);
  for (std::size_t i = 0; i < 16; ++i) pose[i] = (i % 5 == 0 ? 1 : 0) + static_cast<double>(i) / 64;
  CHECK(tensor("stage.coarse.T").shape == std::vector<std::size_t>{4, 4});
  CHECK(values(tensor("stage.coarse.T").f64()) == pose);

  using Integers = std::numeric_limits<std::int32_t>;
  CHECK(values(tensor("stage.source.kept").i32()) ==
        std::vector<std::int32_t>{5, 0, Integers::min(), Integers::max()});

  std::vector<float> block(40);
  for (std::size_t i = 0; i < 40; ++i) block[i] = static_cast<float>(i);
  CHECK(values(file.tensor_f32("stage.source.network0.block0", {2, 5, 2, 2})) == block);

  using Floats = std::numeric_limits<float>;
  const auto extremes = file.tensor_f32("stage.source.significance", {5});
  CHECK(values(extremes) ==
        std::vector<float>{Floats::max(), Floats::lowest(), Floats::denorm_min(), -0.0F, 0.0F});
  CHECK(std::signbit(extremes[3]));
  CHECK_FALSE(std::signbit(extremes[4]));
}

}  // namespace
}  // namespace vnreg::model_format::test
