// A slow, plain LZF encoder for tests: the longest match by search, otherwise literals.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace vnreg::test {

inline std::string lzf_compress(std::string_view data) {
  std::string output;
  std::string literals;
  const auto flush = [&] {
    for (std::size_t at = 0; at < literals.size(); at += 32) {
      const std::string run = literals.substr(at, 32);
      output += static_cast<char>(run.size() - 1);
      output += run;
    }
    literals.clear();
  };
  std::size_t position = 0;
  while (position < data.size()) {
    const std::size_t most = std::min<std::size_t>(264, data.size() - position);
    std::size_t length = 0;
    std::size_t distance = 0;
    // A few distances are enough to meet every kind of command.
    for (const std::size_t candidate : {1, 2, 3, 12, 255, 256, 257, 300, 600, 8191, 8192}) {
      if (candidate > position) break;
      std::size_t same = 0;
      while (same < most && data[position + same] == data[position + same - candidate]) ++same;
      if (same > length) {
        length = same;
        distance = candidate;
      }
    }
    if (length < 3) {
      literals += data[position++];
      continue;
    }
    flush();
    const std::size_t code = length - 2;
    const std::size_t high = (distance - 1) >> 8U;
    output += static_cast<char>((std::min<std::size_t>(code, 7) << 5U) | high);
    if (code >= 7) output += static_cast<char>(code - 7);
    output += static_cast<char>((distance - 1) & 255U);
    position += length;
  }
  flush();
  return output;
}

}  // namespace vnreg::test
