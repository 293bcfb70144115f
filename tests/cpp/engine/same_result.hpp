// Equality of results, bit by bit, but for the times.
#pragma once

#include <catch2/catch.hpp>
#include <cstring>

#include "vnreg/vnreg.hpp"

namespace vnreg::test {

/// NaN equals NaN.
template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

inline void check_same(const Result& a, const Result& b) {
  REQUIRE(to_string(a.status) == to_string(b.status));
  REQUIRE(a.has_pose == b.has_pose);
  REQUIRE(same_bits(a.T_target_source, b.T_target_source));
  REQUIRE(same_bits(a.T_target_source_coarse, b.T_target_source_coarse));
  REQUIRE(same_bits(a.covariance, b.covariance));
  REQUIRE(same_bits(a.confidence, b.confidence));
  REQUIRE(same_bits(a.overlap, b.overlap));
  REQUIRE(same_bits(a.rmse, b.rmse));
  REQUIRE(same_bits(a.score, b.score));
  REQUIRE(same_bits(a.evidence.values(), b.evidence.values()));
  REQUIRE(a.points_source == b.points_source);
  REQUIRE(a.points_target == b.points_target);
  REQUIRE(a.alternatives.size() == b.alternatives.size());
  for (std::size_t i = 0; i < a.alternatives.size(); ++i) {
    REQUIRE(same_bits(a.alternatives[i].T_target_source, b.alternatives[i].T_target_source));
    REQUIRE(same_bits(a.alternatives[i].score, b.alternatives[i].score));
  }
}

}  // namespace vnreg::test
