// Wall-clock time of the stages.
#pragma once

#include <chrono>

namespace vnreg::detail {

class Stopwatch {
 public:
  /// Milliseconds since the last lap.
  double lap() noexcept {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double, std::milli> elapsed = now - start_;
    start_ = now;
    return elapsed.count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace vnreg::detail
