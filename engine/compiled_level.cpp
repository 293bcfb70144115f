#include "engine/compiled_level.hpp"

namespace vnreg::detail {

#if !defined(__x86_64__)
constinit const char* const compiled_level = "portable";
#elif defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512CD__) && \
    defined(__AVX512DQ__) && defined(__AVX512VL__)
constinit const char* const compiled_level = "x86-64-v4";
#elif defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__) && defined(__F16C__)
constinit const char* const compiled_level = "x86-64-v3";
#elif defined(__SSE4_2__) && defined(__POPCNT__)
constinit const char* const compiled_level = "x86-64-v2";
#else
constinit const char* const compiled_level = "x86-64";
#endif

}  // namespace vnreg::detail
