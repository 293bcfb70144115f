// How far a long run is, on stderr, for a person at a terminal.
#pragma once

#include <chrono>
#include <cstddef>

namespace vnreg::cli {

/// One line that is drawn over and over: a bar, the count, the rate and the time left. Draws
/// nothing unless stderr is a terminal; erased when it goes. Serves one thread at a time.
class ProgressBar {
 public:
  /// `done` of `total` were finished before this run. `quiet`: never draw.
  ProgressBar(std::size_t done, std::size_t total, bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Now `done` are finished. Draws at most ten times a second.
  void update(std::size_t done);

 private:
  using Clock = std::chrono::steady_clock;

  void draw(std::size_t done, Clock::time_point now) const;

  std::size_t done_before_;
  std::size_t total_;
  bool visible_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point next_drawing_ = begin_;
};

}  // namespace vnreg::cli
