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
    end_.store(End::none, std::memory_order_relaxed);
    cancellation_ = options.cancellation;
    has_budget_ = options.time_budget_ms > 0;
    if (has_budget_) {
      using Milliseconds = std::chrono::duration<double, std::milli>;
      time_ = Clock::now() +
              std::chrono::duration_cast<Clock::duration>(Milliseconds(options.time_budget_ms));
    }
  }

  /// Whether the limit is reached; from then on the call counts as expired. Any thread.
  bool passed() noexcept {
    if (expired()) return true;
    const End found = now();
    if (found == End::none) return false;
    End first = End::none;  // only what was seen first counts: a cancellation may be taken back
    end_.compare_exchange_strong(first, found, std::memory_order_relaxed);
    return true;
  }

  /// Whether passed() has been true in this call: then some work was left out.
  bool expired() const noexcept { return end_.load(std::memory_order_relaxed) != End::none; }

  /// Whether that was because of a cancellation, also one that has been taken back since.
  bool cancelled() const noexcept { return end_.load(std::memory_order_relaxed) == End::cancelled; }

 private:
  using Clock = std::chrono::steady_clock;

  enum class End : char { none, cancelled, out_of_time };

  End now() const noexcept {
    if (cancellation_ != nullptr && cancellation_->requested()) return End::cancelled;
    return has_budget_ && Clock::now() >= time_ ? End::out_of_time : End::none;
  }

  std::atomic<End> end_{End::none};
  bool has_budget_ = false;
  Clock::time_point time_{};
  const Cancellation* cancellation_ = nullptr;
};

}  // namespace vnreg::detail
