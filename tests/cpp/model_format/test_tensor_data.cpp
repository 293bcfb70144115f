// Elements and padding that break a rule, under checksums that are right.
#include <bit>

#include "refusals.hpp"

namespace vnreg::model_format::test {
namespace {

// Element `index` of `count` is `bits`, the others are zero; then a second tensor follows.
Bytes with_element(std::uint32_t dtype, std::size_t count, std::size_t index, std::uint64_t bits) {
  const int size = dtype == 2 ? 8 : 4;
  Bytes elements;
  for (std::size_t i = 0; i < count; ++i) elements += little_endian(i == index ? bits : 0, size);
  Draft draft;
  draft.data = padded(elements) + f32_data({1});
  draft.table =
      table_entry("a", dtype, {count}, 0) + table_entry("b", 1, {1}, draft.data.size() - 64);
  draft.tensor_count = 2;
  return draft.build();
}

TEST_CASE("data: NaN and infinity in f32 are refused at any position") {
  const std::vector<std::uint64_t> patterns{0x7f800000, 0xff800000, 0x7fc00000, 0xffc00000,
                                            0x7f800001, 0x7fffffff, 0xffffffff};
  for (const std::uint64_t bits : patterns) {
    for (std::size_t index = 0; index < 37; ++index) {
      const Error error =
          check_corrupt(with_element(1, 37, index, bits), "element " + std::to_string(index));
      const bool infinite = bits == 0x7f800000 || bits == 0xff800000;
      CHECK(error.got() == (infinite ? "infinity" : "NaN"));
      CHECK_THAT(error.field(), Catch::Contains("tensor \"a\""));
    }
  }
}

TEST_CASE("data: NaN and infinity in f64 are refused at any position") {
  const std::vector<std::uint64_t> patterns{0x7ff0000000000000, 0xfff0000000000000,
                                            0x7ff8000000000000, 0x7ff0000000000001,
                                            0xffffffffffffffff};
  for (const std::uint64_t bits : patterns) {
    for (std::size_t index = 0; index < 19; ++index) {
      const Error error =
          check_corrupt(with_element(2, 19, index, bits), "element " + std::to_string(index));
      const bool infinite = bits == 0x7ff0000000000000 || bits == 0xfff0000000000000;
      CHECK(error.got() == (infinite ? "infinity" : "NaN"));
    }
  }
}

TEST_CASE("data: the byte of the first bad element is named") {
  const Bytes bytes = with_element(1, 5, 3, 0x7fc00000);
  const std::size_t data_offset = bytes.size() - 128;
  const std::string place = "(byte " + std::to_string(data_offset + 12) + ")";
  CHECK_THAT(check_corrupt(bytes, "tensor \"a\" element 3").field(), Catch::Contains(place));
}

TEST_CASE("data: the largest, the smallest and negative zero are kept bit by bit") {
  for (const std::uint32_t bits : {0x7f7fffffu, 0xff7fffffu, 1u, 0x80000001u, 0x80000000u}) {
    const Parsed parsed = parse(with_element(1, 3, 2, bits));
    CHECK(std::bit_cast<std::uint32_t>(parsed.file.tensor_f32("a", {3})[2]) == bits);
  }
  for (const std::uint64_t bits : {0x7fefffffffffffffu, 1ul, 0x8000000000000000u}) {
    const Parsed parsed = parse(with_element(2, 3, 2, bits));
    CHECK(std::bit_cast<std::uint64_t>(parsed.file.tensors().find("a")->second.f64()[2]) == bits);
  }
}

TEST_CASE("data: an i32 may have any bits") {
  const Parsed parsed = parse(with_element(3, 3, 1, 0x7fc00000));
  CHECK(parsed.file.tensors().find("a")->second.i32()[1] == 0x7fc00000);
  CHECK(parse(with_element(3, 3, 1, 0xffffffff)).file.tensors().find("a")->second.i32()[1] == -1);
}

TEST_CASE("data: a nonzero byte anywhere in the padding of a tensor is refused") {
  Draft draft = small_draft();
  const Bytes clean = draft.data;
  const std::vector<std::pair<std::size_t, std::size_t>> paddings{{24, 64}, {84, 128}, {200, 256}};
  const std::size_t data_offset = draft.build().size() - clean.size();
  for (const auto& [begin, end] : paddings) {
    for (std::size_t i = begin; i < end; ++i) {
      draft.data = clean;
      draft.data[i] = static_cast<char>(i % 255 + 1);
      const Error error = check_corrupt(draft.build(), "padding after tensor");
      const std::string place = "(byte " + std::to_string(data_offset + i) + ")";
      CHECK_THAT(error.field(), Catch::Contains(place));
    }
  }
}

}  // namespace
}  // namespace vnreg::model_format::test
