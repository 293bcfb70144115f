// Attacks on a whole file that leave the checksums as they were.
#include "refusals.hpp"

namespace vnreg::model_format::test {
namespace {

Bytes replaced(const Bytes& bytes, const Bytes& from, const Bytes& to) {
  Bytes result;
  for (std::size_t i = 0; i < bytes.size();) {
    const bool match = bytes.compare(i, from.size(), from) == 0;
    result += match ? to : Bytes(1, bytes[i]);
    i += match ? from.size() : 1;
  }
  return result;
}

TEST_CASE("damage: the undamaged file is read") {
  const Parsed parsed = parse(small_draft().build());
  CHECK(parsed.file.metadata().size() == 4);
  CHECK(parsed.file.tensors().size() == 3);
}

TEST_CASE("damage: every change of every single byte is refused") {
  const Bytes bytes = small_draft().build();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (int pattern = 1; pattern < 256; ++pattern) {
      Bytes damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ pattern);
      if (!refusal(damaged)) FAIL("byte " << i << " xor " << pattern << " was accepted");
    }
  }
}

TEST_CASE("damage: every pair of flipped bits in the header is refused") {
  const Bytes bytes = small_draft().build();
  for (std::size_t first = 0; first < 512; ++first) {
    for (std::size_t second = 0; second < first; ++second) {
      Bytes damaged = bytes;
      for (const std::size_t bit : {first, second}) {
        damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
      }
      if (!refusal(damaged)) FAIL("bits " << first << " and " << second << " were accepted");
    }
  }
}

TEST_CASE("damage: a file cut at any length is refused") {
  const Bytes bytes = small_draft().build();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    INFO("cut to " << size);
    const ErrorCode code = size < 8 ? ErrorCode::not_a_model : ErrorCode::corrupt_model;
    const std::string field = size < 8 ? "magic" : size < 64 ? "header" : "file size";
    check_refused(bytes.substr(0, size), code, field);
  }
}

TEST_CASE("damage: a longer file is refused") {
  const Bytes bytes = small_draft().build();
  for (const std::size_t size : {1u, 2u, 63u, 64u, 65u, 4096u}) {
    for (const char fill : {'\0', '\xff'}) {
      check_corrupt(bytes + Bytes(size, fill), "file size");
    }
  }
  check_corrupt(bytes + bytes, "file size");
}

TEST_CASE("damage: a file without its first bytes is refused") {
  const Bytes bytes = small_draft().build();
  for (std::size_t size = 1; size < bytes.size(); ++size) REQUIRE(refusal(bytes.substr(size)));
}

TEST_CASE("damage: a transfer as text is refused and named") {
  const Bytes bytes = small_draft().build();
  Bytes seven_bits = bytes;
  for (char& byte : seven_bits) byte = static_cast<char>(byte & 0x7f);
  const std::vector<Bytes> transfers{replaced(bytes, "\r\n", "\n"), replaced(bytes, "\n", "\r\n"),
                                     replaced(bytes, "\r", "\n"), replaced(bytes, "\n", "\r"),
                                     seven_bits};
  for (const Bytes& damaged : transfers) {
    const Error error = check_refused(damaged, ErrorCode::not_a_model, "magic");
    CHECK_THAT(error.got(), Catch::Contains("transfer as text"));
  }
}

TEST_CASE("damage: a file cut at the end-of-file character is refused") {
  const Bytes bytes = small_draft().build();
  check_refused(bytes.substr(0, bytes.find('\x1a')), ErrorCode::not_a_model, "magic");
}

TEST_CASE("damage: a file that went through UTF-8 is refused") {
  Bytes damaged;
  for (const char byte : small_draft().build()) {
    const auto value = static_cast<unsigned char>(byte);
    if (value >= 0x80) damaged += static_cast<char>(0xc0 | (value >> 6));
    damaged += static_cast<char>(value < 0x80 ? value : 0x80 | (value & 0x3f));
  }
  check_refused(damaged, ErrorCode::not_a_model, "magic");
}

TEST_CASE("damage: other files are not models") {
  check_refused("", ErrorCode::not_a_model, "magic");
  check_refused(Bytes(4096, '\0'), ErrorCode::not_a_model, "magic");
  check_refused("ply\nformat ascii 1.0\n" + Bytes(100, ' '), ErrorCode::not_a_model, "magic");
  check_refused("PK\x03\x04" + Bytes(100, 'x'), ErrorCode::not_a_model, "magic");
}

}  // namespace
}  // namespace vnreg::model_format::test
