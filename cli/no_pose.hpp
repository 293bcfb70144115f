// Why a pair of clouds has no pose: which cloud is to blame, and what is wrong with it.
#pragma once

#include <string>

#include "cloud_file/cloud_file.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::cli {

struct NamedCloud {
  const std::string& path;
  const cloud_file::Points& points;
};

/// One line "FILE: expected ..., found ..." for a result without a pose. `min_points` is the
/// model's.
std::string why_no_pose(const Result& result, const NamedCloud& source, const NamedCloud& target,
                        int min_points);

}  // namespace vnreg::cli
