// One loop shape for all parallel work: independent tasks, handed out dynamically. No result
// depends on which thread runs a task. With one thread no parallel region is opened.
#pragma once

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <thread>
#include <vector>
#else
#include <omp.h>
#endif

#include "kernels/packets.hpp"

namespace vnreg::detail {

using kernels::Index;

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

/// The number of threads that `requested` (0: what OpenMP says) stands for.
inline int thread_count(int requested) noexcept {
#ifdef __SANITIZE_THREAD__
  return requested > 0 ? requested : static_cast<int>(std::thread::hardware_concurrency());
#else
  return requested > 0 ? requested : omp_get_max_threads();
#endif
}

}  // namespace vnreg::detail
