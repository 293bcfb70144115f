#include "engine/options.hpp"

#include <algorithm>
#include <string>

namespace vnreg::detail {
namespace {

constexpr double longest_budget_ms = 1e9;

[[noreturn]] void refuse(const char* field, std::string expected, std::string got) {
  throw Error(ErrorCode::invalid_option, field, std::move(expected), std::move(got));
}

void check_mode(const ModelData& model, Mode mode) {
  switch (mode) {
    case Mode::coarse:
    case Mode::verified:
      return;
    case Mode::paper:
      if (model.arch.fine_iterations > 0) return;
      refuse("mode", "coarse or verified (the model has no fine register)", "paper");
  }
  refuse("mode", "coarse, paper or verified", std::to_string(static_cast<int>(mode)));
}

/// 0 stands for a default and is always allowed.
void check_range(const char* field, int value, int min, int max) {
  if (value == 0 || (value >= min && value <= max)) return;
  refuse(field, "0 or " + std::to_string(min) + " to " + std::to_string(max),
         std::to_string(value));
}

}  // namespace

void check_threads(int threads) { check_range("threads", threads, 1, 1024); }

Index checked_max_points(const ModelData& model, const Options& options) {
  check_mode(model, options.mode);
  check_threads(options.threads);
  const int fewest = std::max(64, static_cast<int>(model.arch.min_points()));
  check_range("max_points", options.max_points, fewest, 16384);
  if (!(options.time_budget_ms >= 0 && options.time_budget_ms <= longest_budget_ms)) {
    refuse("time_budget_ms", "0 to 1e9", std::to_string(options.time_budget_ms));
  }
  return options.max_points == 0 ? model.arch.points : Index{options.max_points};
}

}  // namespace vnreg::detail
