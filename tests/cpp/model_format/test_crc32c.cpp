#include "model_format/crc32c.hpp"

#include <catch2/catch.hpp>
#include <numeric>
#include <random>

#include "file_builder.hpp"

namespace vnreg::model_format::test {
namespace {

std::uint32_t fast(std::string_view bytes, std::uint32_t previous = 0) {
  return crc32c(std::as_bytes(std::span(bytes)), previous);
}

Bytes random_bytes(std::size_t size, unsigned seed) {
  std::mt19937 generator(seed);
  Bytes bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>(generator() & 0xff);
  return bytes;
}

TEST_CASE("crc32c gives the published values of RFC 3720, B.4") {
  Bytes ascending(32, '\0');
  std::iota(ascending.begin(), ascending.end(), '\0');
  CHECK(fast("") == 0);
  CHECK(fast("123456789") == 0xe3069283);
  CHECK(fast(Bytes(32, '\0')) == 0x8a9136aa);
  CHECK(fast(Bytes(32, '\xff')) == 0x62a8ab43);
  CHECK(fast(ascending) == 0x46dd794e);
  CHECK(fast(Bytes(ascending.rbegin(), ascending.rend())) == 0x113fdb5c);
}

TEST_CASE("crc32c equals the bitwise definition at every length and alignment") {
  const Bytes bytes = random_bytes(96, 1);
  for (std::size_t begin = 0; begin < 9; ++begin) {
    for (std::size_t size = 0; begin + size <= bytes.size(); ++size) {
      const auto piece = std::string_view(bytes).substr(begin, size);
      REQUIRE(fast(piece) == bitwise_crc32c(piece));
    }
  }
}

TEST_CASE("crc32c of pieces is the crc32c of the whole") {
  const Bytes bytes = random_bytes(61, 2);
  const std::string_view whole = bytes;
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    REQUIRE(fast(whole.substr(cut), fast(whole.substr(0, cut))) == fast(whole));
  }
}

}  // namespace
}  // namespace vnreg::model_format::test
