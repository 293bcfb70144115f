#include "kernels/list_within.hpp"

namespace vnreg::kernels {

void mark_within(const float* values, Index count, float limit, std::uint8_t* within) noexcept {
#pragma omp simd
  for (Index i = 0; i < count; ++i) within[i] = values[i] <= limit ? 1 : 0;
}

}  // namespace vnreg::kernels
