// What a fuzz target promises: where it does not hold the process ends, and the fuzzer keeps the
// input.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace vnreg::fuzz {

inline void require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

}  // namespace vnreg::fuzz
