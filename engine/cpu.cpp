#include "engine/cpu.hpp"

#include "engine/compiled_level.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg {

std::string_view instruction_set() noexcept { return detail::compiled_level; }

namespace detail {
namespace {

bool processor_fits() noexcept {
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool v2 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
  const bool v3 = v2 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                  __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  const bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                  __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                  __builtin_cpu_supports("avx512vl");
  const std::string_view level = compiled_level;
  if (level == "x86-64-v4") return v4;
  if (level == "x86-64-v3") return v3;
  if (level == "x86-64-v2") return v2;
#endif
  return true;
}

}  // namespace

void require_cpu() {
  if (!processor_fits()) {
    throw Error(ErrorCode::unsupported_cpu, "processor", compiled_level, "less");
  }
}

}  // namespace detail
}  // namespace vnreg
