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
  const std::string_view level = compiled_level;
  if (level == "x86-64-v4") return __builtin_cpu_supports("x86-64-v4") != 0;
  if (level == "x86-64-v3") return __builtin_cpu_supports("x86-64-v3") != 0;
  if (level == "x86-64-v2") return __builtin_cpu_supports("x86-64-v2") != 0;
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
