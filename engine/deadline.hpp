// When a call has to end. The limits of a call are set when it starts; every parallel task asks
// before it begins (engine/parallel.hpp), so a call outlives its limit by one task, and the
// pipeline looks between its steps whether a task was left out.
#pragma once

#include <atomic>
#include <chrono>

#include "vnreg/vnreg.hpp"

namespace vnreg::detail {

class Deadline {
 public:
  Deadline() = default;
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

  /// Begins a call. Without a budget and a cancellation in the options nothing ever expires.
  void start(const Options& options) noexcept {
    expired_.store(false, std::memory_order_relaxed);
    cancellation_ = options.cancellation;
    has_budget_ = options.time_budget_ms > 0;
    if (has_budget_) {
      using Milliseconds = std::chrono::duration<double, std::milli>;
      end_ = Clock::now() +
             std::chrono::duration_cast<Clock::duration>(Milliseconds(options.time_budget_ms));
    }
  }

  /// Whether the limit is reached; from then on the call counts as expired. Any thread.
  bool passed() noexcept {
    if (expired()) return true;
    if (!cancelled() && !(has_budget_ && Clock::now() >= end_)) return false;
    expired_.store(true, std::memory_order_relaxed);
    return true;
  }

  /// Whether passed() has been true in this call: then some work was left out.
  bool expired() const noexcept { return expired_.load(std::memory_order_relaxed); }

  bool cancelled() const noexcept { return cancellation_ != nullptr && cancellation_->requested(); }

 private:
  using Clock = std::chrono::steady_clock;

  std::atomic<bool> expired_{false};
  bool has_budget_ = false;
  Clock::time_point end_{};
  const Cancellation* cancellation_ = nullptr;
};

}  // namespace vnreg::detail
