/// @file
/// Stopping a running call from outside.
#pragma once

#include <atomic>

namespace vnreg {

/// A flag that another thread, or a signal handler, may raise while calls run that were given its
/// address (Options::cancellation). They then return within about a millisecond, with
/// Status::cancelled. Any number of registrars may share one. It must outlive them.
///
/// One byte without a heap allocation, unlike std::stop_source: it can be made in a real-time
/// thread, raised in a signal handler, and handed through the C API.
class Cancellation {
 public:
  /// Ends the calls that run with it, and those that begin, until reset(). Async-signal-safe.
  void request() noexcept { requested_.store(true, std::memory_order_relaxed); }
  /// Lets calls run again.
  void reset() noexcept { requested_.store(false, std::memory_order_relaxed); }
  /// Whether it is raised.
  bool requested() const noexcept { return requested_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> requested_{false};
  static_assert(std::atomic<bool>::is_always_lock_free);
};

}  // namespace vnreg
