// What `vnreg align` prints: for people, or as JSON.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "vnreg/vnreg.hpp"

namespace vnreg::cli {

struct AlignReport {
  const Result& result;
  std::string_view model;  // its name
  Mode mode;
  std::array<double, 3> source_middle;  // mean of the source's points
};

/// Several lines: pose, rotation, translation, uncertainty, status, confidence, alternatives,
/// overlap, residual, times.
std::string to_text(const AlignReport& report);

/// One JSON object and a line end; docs/cli.md lists the keys. What is not known is null.
std::string to_json(const AlignReport& report);

}  // namespace vnreg::cli
