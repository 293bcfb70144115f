#include "cloud_file/ply_writer.hpp"

#include <bit>

#include "cloud_file/whole_file.hpp"

namespace vnreg::cloud_file {
namespace {

static_assert(std::endian::native == std::endian::little, "the points are written as they lie");

std::string header_of(std::size_t count) {
  return "ply\nformat binary_little_endian 1.0\ncomment written by vnreg\nelement vertex " +
         std::to_string(count) +
         "\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
}

}  // namespace

void write_ply(const std::string& path, const Points& points) {
  static_assert(sizeof(Points::value_type) == 3 * sizeof(double));
  const std::string header = header_of(points.size());
  write_whole_file(
      path,
      {header, {reinterpret_cast<const char*>(points.data()), points.size() * sizeof(points[0])}});
}

}  // namespace vnreg::cloud_file
