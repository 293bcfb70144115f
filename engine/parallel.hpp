// One loop shape for all parallel work: independent tasks, handed out dynamically. No result
// depends on which thread runs a task. With one thread no parallel region is opened. Once a call's
// deadline has passed, its tasks are left out.
#pragma once

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <thread>
#include <vector>
#else
#include <omp.h>
#endif

#include <span>

#include "engine/deadline.hpp"
#include "kernels/packets.hpp"

namespace vnreg::detail {

using kernels::Index;

/// How many threads work for a registrar, and until when.
struct Threads {
  int count;
  Deadline* deadline;

  operator int() const noexcept { return count; }  // NOLINT: implicit on purpose
};

/// Which clouds of a pair a stage works on, ascending: 0 is the source, 1 the target.
using Sides = std::span<const Index>;
inline constexpr Index both_sides[2] = {0, 1};

inline bool contains(Sides sides, Index side) noexcept {
  return !sides.empty() && (sides.front() == side || sides.back() == side);
}

/// Calls task(i, thread) for every i < count, with 0 <= thread < threads.
template <class Task>
void parallel_for(int threads, Index count, const Task& task) noexcept {
  if (threads == 1 || count <= 1) {
    for (Index i = 0; i < count; ++i) task(i, 0);
    return;
  }
#ifdef __SANITIZE_THREAD__
  // ThreadSanitizer does not see the barriers of the OpenMP runtime, so its build uses threads that
  // it does see, for the same tasks.
  std::atomic<Index> next{0};
  const auto work = [&](int thread) {
    for (Index i = next++; i < count; i = next++) task(i, thread);
  };
  std::vector<std::thread> others;
  for (int thread = 1; thread < threads; ++thread) others.emplace_back(work, thread);
  work(0);
  for (std::thread& other : others) other.join();
#else
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
  for (Index i = 0; i < count; ++i) task(i, omp_get_thread_num());
#endif
}

/// The same within a call's deadline: tasks that would begin after it are left out, and
/// threads.deadline->expired() tells so.
template <class Task>
void parallel_for(const Threads& threads, Index count, const Task& task) noexcept {
  parallel_for(threads.count, count, [&](Index i, int thread) {
    if (!threads.deadline->passed()) task(i, thread);
  });
}

/// Calls task(side, part, thread) for every part < parts(side) of all sides, as one list of tasks.
template <class Parts, class Task>
void parallel_for_parts(const Threads& threads, Sides sides, const Parts& parts,
                        const Task& task) noexcept {
  Index total = 0;
  for (const Index side : sides) total += parts(side);
  parallel_for(threads, total, [&](Index i, int thread) {
    const Index first_parts = parts(sides.front());
    if (i < first_parts) {
      task(sides.front(), i, thread);
    } else {
      task(sides.back(), i - first_parts, thread);
    }
  });
}

/// The number of threads that `requested` (0: what OpenMP says) stands for.
inline int thread_count(int requested) noexcept {
#ifdef __SANITIZE_THREAD__
  return requested > 0 ? requested : static_cast<int>(std::thread::hardware_concurrency());
#else
  return requested > 0 ? requested : omp_get_max_threads();
#endif
}

}  // namespace vnreg::detail
