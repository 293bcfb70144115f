#include "engine/cpu.hpp"

#include <string>

#include "vnreg/vnreg.hpp"

namespace vnreg {
namespace {

#if !defined(__x86_64__)
#define VNREG_LEVEL "portable"
#elif defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512CD__) && \
    defined(__AVX512DQ__) && defined(__AVX512VL__)
#define VNREG_LEVEL "x86-64-v4"
#elif defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__) && defined(__F16C__)
#define VNREG_LEVEL "x86-64-v3"
#elif defined(__SSE4_2__) && defined(__POPCNT__)
#define VNREG_LEVEL "x86-64-v2"
#else
#define VNREG_LEVEL "x86-64"
#endif

bool processor_fits() noexcept {
#if defined(__x86_64__)
  __builtin_cpu_init();
  return __builtin_cpu_supports(VNREG_LEVEL) != 0;
#else
  return true;
#endif
}

}  // namespace

std::string_view instruction_set() noexcept { return VNREG_LEVEL; }

namespace detail {

void require_cpu() {
  if (!processor_fits()) {
    throw Error(ErrorCode::unsupported_cpu, "processor", VNREG_LEVEL, "less");
  }
}

}  // namespace detail
}  // namespace vnreg
