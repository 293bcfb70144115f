#include "engine/builtin_model.hpp"

#ifdef VNREG_HAVE_BUILTIN_MODEL
// Defined by builtin_model.S.
extern "C" const std::byte vnreg_builtin_model_begin[];
extern "C" const std::byte vnreg_builtin_model_end[];
#endif

namespace vnreg::detail {

std::span<const std::byte> builtin_model_bytes() noexcept {
#ifdef VNREG_HAVE_BUILTIN_MODEL
  return {vnreg_builtin_model_begin, vnreg_builtin_model_end};
#else
  return {};
#endif
}

}  // namespace vnreg::detail
