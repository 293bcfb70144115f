// Metadata entries that break a rule, under checksums that are right.
#include <cmath>
#include <limits>

#include "refusals.hpp"

namespace vnreg::model_format::test {
namespace {

Bytes with_metadata(const Bytes& metadata) {
  Draft draft;
  draft.metadata = metadata;
  return draft.build();
}

TEST_CASE("metadata: all four types at their limits") {
  const double least = std::numeric_limits<double>::denorm_min();
  const Parsed parsed = parse(with_metadata(
      f64_entry("a", -std::numeric_limits<double>::max()) + f64_entry("b", least) +
      f64_entry("c", -0.0) + u64_entry("d", std::numeric_limits<std::uint64_t>::max()) +
      bool_entry("e", 0) + bool_entry("f", 1) + string_entry("g", "") +
      string_entry("h", "\xf0\x9f\x90\xb0 \xc3\xa9\n")));
  const auto& values = parsed.file.metadata();
  CHECK(values.find("a")->second == Value(-std::numeric_limits<double>::max()));
  CHECK(values.find("b")->second == Value(least));
  CHECK(std::signbit(std::get<double>(values.find("c")->second)));
  CHECK(values.find("d")->second == Value(std::numeric_limits<std::uint64_t>::max()));
  CHECK(values.find("e")->second == Value(false));
  CHECK(values.find("f")->second == Value(true));
  CHECK(values.find("g")->second == Value(std::string()));
  CHECK(values.find("h")->second == Value(std::string("\xf0\x9f\x90\xb0 \xc3\xa9\n")));
}

TEST_CASE("metadata: duplicate keys are refused") {
  const Error error =
      check_corrupt(with_metadata(u64_entry("a", 1) + u64_entry("a", 1)), "metadata key 1");
  CHECK_THAT(error.field(), Catch::Contains("(byte 85)"));  // 64 + (4 + 1 + 4 + 8) + 4
}

TEST_CASE("metadata: unsorted keys are refused") {
  check_corrupt(with_metadata(u64_entry("b", 1) + u64_entry("a", 1)), "metadata key 1");
  check_corrupt(with_metadata(u64_entry("a.b", 1) + u64_entry("a", 1)), "metadata key 1");
  check_corrupt(with_metadata(u64_entry("a", 1) + u64_entry("Z", 1)), "metadata key 1");
}

TEST_CASE("metadata: a key with any byte outside the alphabet is refused") {
  const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._";
  for (int value = 0; value < 256; ++value) {
    const std::string key = std::string("k") + static_cast<char>(value);
    const bool allowed = alphabet.find(static_cast<char>(value)) != std::string::npos;
    INFO("byte " << value);
    REQUIRE(refusal(with_metadata(u64_entry(key, 1))).has_value() == !allowed);
  }
}

TEST_CASE("metadata: a refused key is not echoed into the message") {
  const Error error = check_corrupt(with_metadata(u64_entry("a\x1b[2J", 1)), "metadata key 0");
  CHECK(std::string(error.what()).find('\x1b') == std::string::npos);
}

TEST_CASE("metadata: key lengths from 1 to 128 and no others") {
  for (const std::size_t length : {1u, 2u, 127u, 128u}) {
    CHECK_FALSE(refusal(with_metadata(u64_entry(std::string(length, 'k'), 1))));
  }
  for (const std::size_t length : {0u, 129u, 4096u}) {
    check_corrupt(with_metadata(u64_entry(std::string(length, 'k'), 1)), "metadata key 0 length");
  }
  check_corrupt(with_metadata(u32(0xffffffff) + "k"), "metadata key 0 length");
}

TEST_CASE("metadata: an unknown type is refused") {
  const std::uint32_t type = GENERATE(0u, 5u, 0x101u, 0xffffffffu);
  check_corrupt(with_metadata(entry("k", type, u64(0))), "metadata \"k\" type");
}

TEST_CASE("metadata: a NaN or infinite number is refused") {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double value : {infinity, -infinity, nan, -nan}) {
    check_corrupt(with_metadata(f64_entry("k", value)), "metadata \"k\"");
  }
}

TEST_CASE("metadata: a non-canonical bool is refused") {
  for (int value = 2; value < 256; ++value) {
    check_corrupt(with_metadata(bool_entry("k", static_cast<std::uint8_t>(value))),
                  "metadata \"k\"");
  }
}

TEST_CASE("metadata: text that is not UTF-8 is refused") {
  const std::vector<std::string> texts{"\xff",
                                       "abc\x80",
                                       "\xc3",
                                       "\xc0\xaf",               // overlong
                                       "\xe0\x80\xaf",           // overlong
                                       "\xed\xa0\x80",           // surrogate
                                       "\xf4\x90\x80\x80",       // past U+10FFFF
                                       std::string("a\0b", 3)};  // cuts a C string
  for (const std::string& text : texts) {
    check_corrupt(with_metadata(string_entry("k", text)), "metadata \"k\"");
  }
}

TEST_CASE("metadata: text cannot borrow its last byte from the next entry") {
  Bytes text = string_entry("a", "\xc3");
  check_corrupt(with_metadata(text + "\xa9"), "metadata \"a\" (byte 77)");
}

TEST_CASE("metadata: a value that runs over the end of the metadata is refused") {
  for (const std::uint64_t length : {2u, 64u, 0x7fffffffu, 0xffffffffu}) {
    check_corrupt(with_metadata(entry("k", 4, u32(length) + "x")), "metadata \"k\"");
  }
  check_corrupt(with_metadata(entry("k", 1, "1234567")), "metadata \"k\"");
  check_corrupt(with_metadata(entry("k", 2, "")), "metadata \"k\"");
  check_corrupt(with_metadata(entry("k", 3, "")), "metadata \"k\"");
}

TEST_CASE("metadata: an entry cut at any byte is refused") {
  const Bytes whole = u64_entry("a", 1) + string_entry("b", "text");
  for (std::size_t size = 1; size < whole.size(); ++size) {
    const bool between_entries = size == u64_entry("a", 1).size();
    if (!between_entries) check_corrupt(with_metadata(whole.substr(0, size)), "metadata");
  }
}

TEST_CASE("metadata: exactly 1 MiB is read, one byte more is refused") {
  const std::size_t overhead = string_entry("k", "").size();
  const std::size_t room = (std::size_t{1} << 20) - overhead;
  CHECK_FALSE(refusal(with_metadata(string_entry("k", std::string(room, 'x')))));
  check_corrupt(with_metadata(string_entry("k", std::string(room + 1, 'x'))), "metadata bytes");
}

}  // namespace
}  // namespace vnreg::model_format::test
