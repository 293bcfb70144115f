// Ends a long run in good order when its user says so.
#pragma once

#include <atomic>

namespace vnreg::cli {

/// While it lives, the first SIGINT or SIGTERM sets a flag, and the second one kills as usual; a
/// file that may not grow is an error of its write and no signal. There is one at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// True once a signal came.
  const std::atomic<bool>& flag() const noexcept;
};

}  // namespace vnreg::cli
