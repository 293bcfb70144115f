// Tensor tables that break a rule, under checksums that are right.
#include <limits>

#include "refusals.hpp"

namespace vnreg::model_format::test {
namespace {

constexpr std::uint64_t two_to_the(int exponent) { return std::uint64_t{1} << exponent; }
constexpr std::uint64_t huge = std::numeric_limits<std::uint64_t>::max();

Draft with_table(const Bytes& table, std::uint64_t count, std::size_t data_bytes) {
  Draft draft;
  draft.table = table;
  draft.tensor_count = count;
  draft.data = Bytes(data_bytes, '\0');
  return draft;
}

Bytes one_tensor(const std::vector<std::uint64_t>& shape, std::uint32_t dtype = 1) {
  return with_table(table_entry("w", dtype, shape, 0), 1, 64).build();
}

Bytes two_tensors(std::string_view first, std::string_view second, std::uint64_t first_offset = 0,
                  std::uint64_t second_offset = 64) {
  return with_table(
             table_entry(first, 1, {3}, first_offset) + table_entry(second, 1, {3}, second_offset),
             2, 128)
      .build();
}

TEST_CASE("table: two tensors side by side are read") {
  const Parsed parsed = parse(two_tensors("a", "b"));
  CHECK(parsed.file.tensor_f32("a", {3}).data() + 16 == parsed.file.tensor_f32("b", {3}).data());
}

TEST_CASE("table: overlapping tensors are refused") {
  const Error error = check_corrupt(two_tensors("a", "b", 0, 0), "tensor \"b\" offset");
  CHECK(error.expected() == "64");
  CHECK(error.got() == "0");
}

TEST_CASE("table: swapped offsets are refused") {
  check_corrupt(two_tensors("a", "b", 64, 0), "tensor \"a\" offset");
}

TEST_CASE("table: unaligned and wrapping offsets are refused") {
  const std::uint64_t offset = GENERATE(std::uint64_t{4}, std::uint64_t{12}, std::uint64_t{63},
                                        std::uint64_t{65}, huge, huge - 63);
  check_corrupt(two_tensors("a", "b", 0, offset), "tensor \"b\" offset");
  check_corrupt(two_tensors("a", "b", offset, 64), "tensor \"a\" offset");
}

TEST_CASE("table: a gap between tensors is refused") {
  Draft draft = with_table(table_entry("a", 1, {3}, 0) + table_entry("b", 1, {3}, 128), 2, 192);
  check_corrupt(draft.build(), "tensor \"b\" offset");
}

TEST_CASE("table: duplicate names are refused") {
  check_corrupt(two_tensors("a", "a"), "name of tensor 1");
}

TEST_CASE("table: unsorted names are refused") {
  check_corrupt(two_tensors("b", "a"), "name of tensor 1");
  check_corrupt(two_tensors("a.10", "a.1"), "name of tensor 1");
  check_corrupt(two_tensors("a", "B"), "name of tensor 1");
  CHECK_FALSE(refusal(two_tensors("a.1", "a.10")));
}

TEST_CASE("table: names outside the alphabet or the length are refused") {
  check_corrupt(two_tensors("", "b"), "name of tensor 0 length");
  check_corrupt(two_tensors(std::string(129, 'a'), "b"), "name of tensor 0 length");
  CHECK_FALSE(refusal(two_tensors(std::string(128, 'a'), "b")));
  for (const char* name : {"a b", "a/b", "../a", "a-b", "a\n", "\xc3\xa9", "a\"b"}) {
    check_corrupt(two_tensors(name, "zz"), "name of tensor 0");
  }
  check_corrupt(two_tensors(std::string_view("a\0b", 3), "zz"), "name of tensor 0");
}

TEST_CASE("table: ranks 1 to 4 and no others") {
  for (const std::size_t rank : {1u, 2u, 3u, 4u}) {
    CHECK_FALSE(refusal(one_tensor(std::vector<std::uint64_t>(rank, 2))));
  }
  for (const std::size_t rank : {0u, 5u, 6u, 1000u}) {
    check_corrupt(one_tensor(std::vector<std::uint64_t>(rank, 1)), "tensor \"w\" rank");
  }
  const Bytes huge_rank = counted("w") + u32(1) + u32(0xffffffff) + u64(0);
  check_corrupt(with_table(huge_rank, 1, 64).build(), "tensor \"w\" rank");
}

TEST_CASE("table: an unknown dtype is refused") {
  for (const std::uint32_t dtype : {0u, 4u, 0x101u, 0xffffffffu}) {
    check_corrupt(one_tensor({1}, dtype), "tensor \"w\" dtype");
  }
}

TEST_CASE("table: a zero extent on any axis is refused") {
  for (std::size_t rank = 1; rank <= 4; ++rank) {
    for (std::size_t axis = 0; axis < rank; ++axis) {
      std::vector<std::uint64_t> shape(rank, 1);
      shape[axis] = 0;
      const Error error = check_corrupt(one_tensor(shape), "tensor \"w\" extent of axis");
      CHECK(error.got() == "0");
    }
  }
}

TEST_CASE("table: a zero extent does not hide a huge one") {
  check_corrupt(one_tensor({huge, 0}), "tensor \"w\" extent of axis 0");
  check_corrupt(one_tensor({0, huge}), "tensor \"w\" extent of axis 0");
}

TEST_CASE("table: shapes whose product wraps round 2^64 are refused") {
  // Each product of extents and element size is 0, 4 or 64 modulo 2^64.
  const std::vector<std::vector<std::uint64_t>> shapes{
      {two_to_the(62)},
      {two_to_the(62) + 1},
      {two_to_the(62) + 16},
      {two_to_the(32), two_to_the(32)},
      {two_to_the(31), two_to_the(31)},
      {two_to_the(16), two_to_the(16), two_to_the(16), two_to_the(16)},
      {two_to_the(63), 2},
      {2, two_to_the(63)},
      {3, 0x5555555555555556},  // 3 * that = 2^64 + 2
      {huge, huge},             // 1
      {huge, huge, huge, huge}};
  for (const auto& shape : shapes) {
    check_corrupt(one_tensor(shape), "tensor \"w\" extent");
    check_corrupt(one_tensor(shape, 2), "tensor \"w\" extent");
  }
}

TEST_CASE("table: a tensor larger than a file may be is refused at the extent") {
  check_corrupt(one_tensor({two_to_the(28) + 1}), "tensor \"w\" extent");
  check_corrupt(one_tensor({two_to_the(27) + 1}, 2), "tensor \"w\" extent");
  check_corrupt(one_tensor({two_to_the(28)}), "tensor \"w\" padded size");
}

TEST_CASE("table: a tensor that runs over the end of the data is refused") {
  CHECK_FALSE(refusal(one_tensor({16})));
  check_corrupt(one_tensor({17}), "tensor \"w\" padded size");
  CHECK_FALSE(refusal(one_tensor({8}, 2)));
  check_corrupt(one_tensor({9}, 2), "tensor \"w\" padded size");
}

TEST_CASE("table: a tensor smaller than the data it is given is refused") {
  check_corrupt(with_table(table_entry("w", 1, {16}, 0), 1, 128).build(), "data bytes (byte 48)");
}

TEST_CASE("table: an entry cut at any byte is refused") {
  const Bytes whole = table_entry("weight", 1, {1, 1}, 0);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    Draft draft = with_table(whole.substr(0, size), 1, 64);
    // The zero padding after the cut can complete the zero bytes that end an entry, and no more.
    if (refusal(draft.build()).has_value()) continue;
    CHECK(whole.find_first_not_of('\0', size) == std::string::npos);
  }
  Draft no_padding = with_table(whole.substr(0, 24), 1, 64);
  no_padding.metadata = u64_entry(std::string(24, 'k'), 1);  // 40 bytes: 40 + 24 = 64
  check_corrupt(no_padding.build(), "tensor \"weight\"");
}

TEST_CASE("table: a nonzero byte anywhere in the padding after it is refused") {
  Draft draft = with_table(table_entry("w", 1, {1}, 0), 1, 64);
  const std::size_t room = 64 - draft.table.size();
  for (std::size_t i = 0; i < room; ++i) {
    Bytes padding(room, '\0');
    padding[i] = static_cast<char>(i % 255 + 1);
    draft.table_padding = padding;
    const Error error = check_corrupt(draft.build(), "padding after the tensor table");
    const std::string place = "(byte " + std::to_string(64 + draft.table.size() + i) + ")";
    CHECK_THAT(error.field(), Catch::Contains(place));
  }
}

TEST_CASE("table: 65,536 tensors are read") {
  Draft draft;
  draft.tensor_count = 65536;
  for (std::uint64_t i = 0; i < draft.tensor_count; ++i) {
    const std::string digits = std::to_string(100000 + i);
    draft.table += table_entry(digits, 3, {1}, 64 * i);
    draft.data += padded(u32(i));
  }
  const Parsed parsed = parse(draft.build());
  REQUIRE(parsed.file.tensors().size() == 65536);
  CHECK(parsed.file.tensors().find("165535")->second.i32()[0] == 65535);
}

}  // namespace
}  // namespace vnreg::model_format::test
