// What a valid file hands out, and how a wrong question is answered.
#include <cmath>
#include <limits>

#include "refusals.hpp"

namespace vnreg::model_format::test {
namespace {

template <typename Ask>
Error answer(Ask ask) {
  std::optional<Error> error;
  try {
    ask();
  } catch (const Error& caught) {
    error = caught;
  }
  REQUIRE(error.has_value());
  return *error;
}

TEST_CASE("access: metadata of every type") {
  const Parsed parsed = parse(small_draft().build());
  const ModelFile& file = parsed.file;
  CHECK(file.get_string("arch") == "paper");
  CHECK(file.get_u64("neighbours", 1, 64) == 20);
  CHECK(file.get_f64("input.rms_radius", 0.0, 1.0) == 0.5);
  CHECK(file.get_bool("relu.shared_direction"));
  CHECK(file.has("arch"));
  CHECK_FALSE(file.has("arc"));
  CHECK_FALSE(file.has("a.weight"));
}

TEST_CASE("access: an absent key is refused by name") {
  const Parsed parsed = parse(small_draft().build());
  const Error error = answer([&] { parsed.file.get_u64("channels.global", 4, 512); });
  CHECK(error.code() == ErrorCode::wrong_architecture);
  CHECK(error.field() == "metadata \"channels.global\"");
  CHECK(error.expected() == "a u64");
  CHECK(error.got() == "nothing");
}

TEST_CASE("access: no type is converted into another") {
  const Parsed parsed = parse(small_draft().build());
  const ModelFile& file = parsed.file;
  for (const char* key : {"input.rms_radius", "relu.shared_direction", "arch"}) {
    const Error error = answer([&] { file.get_u64(key, 0, 100); });
    CHECK(error.code() == ErrorCode::wrong_architecture);
    CHECK(error.expected() == "a u64");
  }
  CHECK(answer([&] { file.get_f64("neighbours", 0, 100); }).got() == "a u64");
  CHECK(answer([&] { file.get_bool("neighbours"); }).got() == "a u64");
  CHECK(answer([&] { file.get_string("relu.shared_direction"); }).got() == "a bool");
}

TEST_CASE("access: ranges include their ends and refuse the next value") {
  const Parsed parsed = parse(small_draft().build());
  const ModelFile& file = parsed.file;
  CHECK(file.get_u64("neighbours", 20, 20) == 20);
  CHECK(answer([&] { file.get_u64("neighbours", 21, 64); }).expected() == "21 to 64");
  CHECK(answer([&] { file.get_u64("neighbours", 1, 19); }).got() == "20");
  CHECK(file.get_f64("input.rms_radius", 0.5, 0.5) == 0.5);
  CHECK(answer([&] { file.get_f64("input.rms_radius", 0.0, std::nextafter(0.5, 0.0)); }).got() ==
        "0.5");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(answer([&] { file.get_f64("input.rms_radius", nan, 1.0); }).got() == "0.5");
}

TEST_CASE("access: tensors of every dtype, row-major, on cache lines") {
  const Parsed parsed = parse(small_draft().build());
  const auto& tensors = parsed.file.tensors();
  const std::span<const float> a = parsed.file.tensor_f32("a.weight", {2, 3});
  CHECK(std::vector<float>(a.begin(), a.end()) ==
        std::vector<float>{1, -2, 3.5F, 0, -0.0F, 1e-40F});
  CHECK(std::signbit(a[4]));
  const Tensor& b = tensors.find("b")->second;
  CHECK(b.name == "b");
  CHECK(b.shape == std::vector<std::size_t>{1, 1, 1, 5});
  CHECK(b.element_count() == 5);
  CHECK(std::vector<int>(b.i32().begin(), b.i32().end()) == std::vector<int>{-2, -1, 0, 1, 2});
  const Tensor& c = tensors.find("c")->second;
  CHECK(c.f64().size() == 9);
  CHECK(c.f64()[8] == 0.1 * 8);
  for (const auto& [name, tensor] : tensors) {
    CHECK(reinterpret_cast<std::uintptr_t>(tensor.bytes.data()) % 64 == 0);
  }
}

TEST_CASE("access: a tensor of another dtype is refused") {
  const Parsed parsed = parse(small_draft().build());
  const Tensor& a = parsed.file.tensors().find("a.weight")->second;
  const Error error = answer([&] { a.f64(); });
  CHECK(error.code() == ErrorCode::missing_tensor);
  CHECK(error.field() == "tensor \"a.weight\" dtype");
  CHECK(error.expected() == "f64");
  CHECK(error.got() == "f32");
  CHECK(answer([&] { a.i32(); }).expected() == "i32");
  CHECK(answer([&] { parsed.file.tensor_f32("b", {1, 1, 1, 5}); }).got() == "i32");
}

TEST_CASE("access: a tensor of another name or shape is refused") {
  const Parsed parsed = parse(small_draft().build());
  const ModelFile& file = parsed.file;
  const Error absent = answer([&] { file.tensor_f32("d", {2, 3}); });
  CHECK(absent.code() == ErrorCode::missing_tensor);
  CHECK(absent.field() == "tensor \"d\"");
  CHECK(absent.got() == "nothing");
  const Error swapped = answer([&] { file.tensor_f32("a.weight", {3, 2}); });
  CHECK(swapped.code() == ErrorCode::missing_tensor);
  CHECK(swapped.expected() == "(3, 2)");
  CHECK(swapped.got() == "(2, 3)");
  CHECK(answer([&] { file.tensor_f32("a.weight", {6}); }).expected() == "(6)");
  CHECK(answer([&] { file.tensor_f32("a.weight", {2, 3, 1}); }).expected() == "(2, 3, 1)");
  CHECK(answer([&] { file.tensor_f32("a.weight", {}); }).expected() == "()");
}

TEST_CASE("access: bytes that do not start at a multiple of 64 are refused") {
  const Bytes bytes = small_draft().build();
  for (const std::size_t shift : {1u, 4u, 8u, 32u, 63u}) {
    AlignedBytes buffer(bytes.size() + shift);
    std::memcpy(buffer.span().data() + shift, bytes.data(), bytes.size());
    const Error error =
        answer([&] { ModelFile::parse(std::as_const(buffer).span().subspan(shift)); });
    CHECK(error.code() == ErrorCode::invalid_option);
  }
}

TEST_CASE("access: the checksum is the one in the file") {
  const Bytes bytes = small_draft().build();
  const Parsed parsed = parse(bytes);
  CHECK(u32(parsed.file.checksum()) == bytes.substr(60, 4));
}

TEST_CASE("access: a moved buffer is empty and the bytes stay where they were") {
  AlignedBytes first(100);
  const std::byte* place = first.span().data();
  AlignedBytes second(std::move(first));
  CHECK(second.span().data() == place);
  CHECK(second.span().size() == 100);
  CHECK(first.span().empty());  // NOLINT(*-move,*.Move): the promise
  first = std::move(second);
  CHECK(first.span().data() == place);
  CHECK(AlignedBytes(0).span().empty());
}

}  // namespace
}  // namespace vnreg::model_format::test
