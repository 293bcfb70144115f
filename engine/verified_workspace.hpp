// The working memory of mode `verified`, sized once.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/judge_workspace.hpp"
#include "engine/match_buffers.hpp"
#include "engine/motion.hpp"
#include "engine/shared_points.hpp"
#include "engine/surface.hpp"

namespace vnreg::detail {

/// Target points whose pairs go into the table.
inline constexpr Index table_points = 320;
/// Source pairs are drawn in chunks, each of which keeps its best hypotheses. The chunks are the
/// same for any number of threads.
inline constexpr Index draw_chunks = 16;
inline constexpr Index draws_per_chunk = 16;
inline constexpr Index kept_per_chunk = 64;
/// Poses that other registers may add to the hypotheses.
inline constexpr Index most_proposals = 2;
/// With that of shared points.
inline constexpr Index most_given = most_proposals + 1;
/// Distinct hypotheses that are refined.
inline constexpr Index refined_poses = 40;
/// Distinct poses that are refined on all points.
inline constexpr Index final_poses = 12;

/// Ordered pairs of target points, grouped by key.
struct PairTable {
  struct Pair {
    std::uint16_t first, second;
  };
  Index points = 0;
  std::vector<std::uint16_t> keys;   // of all ordered pairs
  std::vector<std::uint32_t> start;  // of each key's pairs, and the end of the last one's
  std::vector<Pair> pairs;
};

struct Hypothesis {
  Motion motion;
  float score;
  std::uint32_t ordinal;  // of its making: what ties are broken by

  friend bool better(const Hypothesis& a, const Hypothesis& b) noexcept {
    return a.score != b.score ? a.score > b.score : a.ordinal < b.ordinal;
  }
};

struct ScoredPose {
  kernels::RigidTransform transform;
  double score = 0;
};

struct VerifiedWorkspace {
  Surface surface[2];
  double radius = 1;  // the unit of length of the surfaces, in network coordinates
  float spacing = 0;  // of the sparser surface, in that unit
  PairTable table;
  MatchBuffers match;    // empty without descriptors
  SharedPoints shared;   // empty without descriptors
  JudgeWorkspace judge;  // empty without descriptors
  /// kept_per_chunk of each chunk, and behind those that are found, those from matches.
  std::vector<Hypothesis> hypotheses;
  std::vector<Index> kept;             // how many of them each chunk has found
  std::vector<ScoredPose> poses;       // what is refined, behind what has been
  ScoredPose considered[final_poses];  // between which was decided last

  VerifiedWorkspace() = default;
  /// `encoded`: how many points of a cloud have descriptors, at most; 0 if the model makes none.
  VerifiedWorkspace(Index max_points, Index encoded);
};

}  // namespace vnreg::detail
