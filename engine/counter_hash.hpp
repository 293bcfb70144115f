// Random numbers without a state: the n-th number of a seed is a function of both, so that it does
// not depend on which thread asks, or when.
#pragma once

#include <cstdint>

namespace vnreg::detail {

/// The finalizer of splitmix64: every bit of the input changes half of the output's bits.
inline std::uint64_t mix(std::uint64_t v) noexcept {
  v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9u;
  v = (v ^ (v >> 27)) * 0x94d049bb133111ebu;
  return v ^ (v >> 31);
}

inline std::uint64_t counter_hash(std::uint64_t seed, std::uint64_t index) noexcept {
  return mix(mix(seed + 0x9e3779b97f4a7c15u) + 0x9e3779b97f4a7c15u * (index + 1));
}

}  // namespace vnreg::detail
