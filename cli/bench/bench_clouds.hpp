// What `vnreg bench` aligns.
#pragma once

#include <cstdint>

#include "cloud_file/cloud_file.hpp"

namespace vnreg::cli {

/// `count` points on a body without symmetry, a bent and tapered tube with a fin, about 2 long and
/// with noise of 0.005; another `seed`, other points of it. The same on every machine, up to the
/// rounding of its sines.
cloud_file::Points bench_cloud(int count, std::uint64_t seed);

/// The points after a turn of 2 radians about (1, 2, 2)/3 and a shift.
cloud_file::Points turned(const cloud_file::Points& points);

}  // namespace vnreg::cli
