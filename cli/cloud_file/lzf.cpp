#include "cloud_file/lzf.hpp"

namespace vnreg::cloud_file {

// The stream is a row of commands. A first byte c below 32 copies the c + 1 bytes that follow it.
// Any other repeats earlier output: its upper three bits are the length, 7 meaning that a byte to
// be added to it follows; its lower five bits and the next byte are the distance less 1. The repeat
// is 2 bytes longer than the length says and may reach into its own output.
std::optional<std::string> lzf_decompress(std::string_view compressed, std::size_t size) {
  std::string output;
  if (size > compressed.size() * lzf_max_expansion) return std::nullopt;
  output.reserve(size);
  std::size_t position = 0;
  const auto next_byte = [&]() -> std::size_t {
    return static_cast<unsigned char>(compressed[position++]);
  };
  while (position < compressed.size()) {
    const std::size_t command = next_byte();
    if (command < 32) {
      const std::size_t length = command + 1;
      if (length > compressed.size() - position || length > size - output.size())
        return std::nullopt;
      output.append(compressed.substr(position, length));
      position += length;
      continue;
    }
    std::size_t length = command >> 5U;
    const std::size_t operand_bytes = length == 7 ? 2 : 1;
    if (operand_bytes > compressed.size() - position) return std::nullopt;
    if (length == 7) length += next_byte();
    length += 2;
    const std::size_t distance = ((command & 31U) << 8U) + next_byte() + 1;
    if (distance > output.size() || length > size - output.size()) return std::nullopt;
    for (std::size_t i = 0; i < length; ++i) output += output[output.size() - distance];
  }
  if (output.size() != size) return std::nullopt;
  return output;
}

}  // namespace vnreg::cloud_file
