// Any bytes to one of the readers of point clouds, chosen by VNREG_FUZZ_READER when this is
// compiled.
#include <cstdint>

#include "cloud_file/readers.hpp"
#include "messages.hpp"

namespace vnreg::fuzz {
namespace {

using cloud_file::CloudFileError;
using cloud_file::Points;

/// The densest points: three numbers of a byte each, packed by LZF, which never does better than 88
/// to 1.
constexpr std::size_t most_points_per_byte = 88 / 3 + 1;

void check(const Points& points, std::size_t bytes) {
  require(points.size() <= most_points_per_byte * bytes, "memory is bounded by the file's size");
  // Looks at every coordinate, so that memory that is not the cloud's is noticed.
  [[maybe_unused]] static volatile double sink;
  for (const auto& point : points) sink = point[0] + point[1] + point[2];
}

void read(std::string_view bytes) {
  try {
    check(VNREG_FUZZ_READER, bytes.size());
  } catch (const CloudFileError& error) {
    check_message(error.what());
  }
}

}  // namespace
}  // namespace vnreg::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  vnreg::fuzz::read({reinterpret_cast<const char*>(data), size});
  return 0;
}
