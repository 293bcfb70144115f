#include "cloud_file/lzf.hpp"

#include "file_bytes.hpp"
#include "lzf_encoder.hpp"

using namespace vnreg::test;
using vnreg::cloud_file::lzf_decompress;
using vnreg::cloud_file::lzf_max_expansion;

namespace {

std::string of(std::initializer_list<int> bytes) {
  std::string text;
  for (const int byte : bytes) text += static_cast<char>(byte);
  return text;
}

}  // namespace

TEST_CASE("LZF: commands by hand", "[lzf]") {
  CHECK(lzf_decompress("", 0) == "");
  CHECK(lzf_decompress(of({2, 'a', 'b', 'c'}), 3) == "abc");
  // Length 1 + 2, distance 2 + 1: repeats abc.
  CHECK(lzf_decompress(of({2, 'a', 'b', 'c', 0x20, 2}), 6) == "abcabc");
  // Distance 1 reads its own output.
  CHECK(lzf_decompress(of({0, 'a', 0x20, 0}), 4) == "aaaa");
  // Length 7 takes one more byte: 7 + 255 + 2 = 264, the most that three bytes give.
  CHECK(lzf_decompress(of({0, 'a', 0xE0, 255, 0}), 265) == std::string(265, 'a'));
  static_assert(lzf_max_expansion * 3 == 264);
  // A distance above 256 uses the lower five bits of the command.
  std::string far;
  for (int run = 0; run < 10; ++run)
    far += of({31}) + std::string(32, static_cast<char>('a' + run));
  CHECK(lzf_decompress(far + of({0x21, 63}), 323)->substr(320) == "aaa");
}

TEST_CASE("LZF: broken streams are refused", "[lzf]") {
  CHECK_FALSE(lzf_decompress(of({2, 'a', 'b'}), 3));                // literals cut short
  CHECK_FALSE(lzf_decompress(of({2, 'a', 'b', 'c'}), 2));           // more than asked for
  CHECK_FALSE(lzf_decompress(of({2, 'a', 'b', 'c'}), 4));           // less than asked for
  CHECK_FALSE(lzf_decompress(of({2, 'a', 'b', 'c', 0x20, 3}), 6));  // before the first byte
  CHECK_FALSE(lzf_decompress(of({0x20, 0}), 3));                    // nothing to repeat
  CHECK_FALSE(lzf_decompress(of({0, 'a', 0x20}), 4));               // distance missing
  CHECK_FALSE(lzf_decompress(of({0, 'a', 0xE0, 1}), 11));           // distance missing after length
  CHECK_FALSE(lzf_decompress(of({0, 'a', 0xE0}), 11));              // length missing
  CHECK_FALSE(lzf_decompress(of({0, 'a', 0xE0, 255, 0}), 264));     // one more than asked for
}

TEST_CASE("LZF: a size that no stream of that length can have is not allocated", "[lzf]") {
  const AllocationWatch watch;
  CHECK_FALSE(lzf_decompress(of({0, 'a', 0xE0, 255, 0}), std::size_t{1} << 40U));
  CHECK(watch.largest() < 4096);
}

TEST_CASE("LZF: decodes what an encoder made", "[lzf]") {
  Random random(static_cast<unsigned>(GENERATE(range(0, 200))));
  std::string data(pick(random, 0, 20000), '\0');
  const std::size_t letters = pick(random, 1, 256);
  for (std::size_t i = 0; i < data.size(); ++i) {
    const bool repeat = i > 300 && pick(random, 0, 3) != 0;
    data[i] = repeat ? data[i - 300] : static_cast<char>(pick(random, 0, letters - 1));
  }
  const std::string compressed = lzf_compress(data);
  CHECK(compressed.size() <= data.size() + data.size() / 32 + 1);
  CHECK(lzf_decompress(compressed, data.size()) == data);
}

TEST_CASE("LZF: any bytes are survived", "[lzf]") {
  Random random(11);
  for (int i = 0; i < 5000; ++i) {
    std::vector<char> noise(pick(random, 0, 60));
    for (char& byte : noise) byte = static_cast<char>(pick(random, 0, 255));
    const std::size_t size = pick(random, 0, 2 * noise.size() + 300);
    const auto data = lzf_decompress({noise.data(), noise.size()}, size);
    REQUIRE((!data || data->size() == size));
  }
}
