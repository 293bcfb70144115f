// Keeps intermediate activations for Registrar::stages(), in torch's layout. Does nothing, at no
// cost, unless it is enabled; runs out of memory quietly (the stages are then empty).
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "kernels/packets.hpp"
#include "kernels/procrustes.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::detail {

using kernels::Index;

class StageRecorder {
 public:
  explicit StageRecorder(bool enabled) noexcept : enabled_(enabled) {}

  bool enabled() const noexcept { return enabled_; }
  const std::vector<Stage>& stages() const noexcept { return stages_; }
  void clear() noexcept;

  /// Vector features that lie in tiles of `tile_points` points, as (points, channels, 3).
  void vectors(const char* prefix, const char* name, const float* tiles, Index rows, Index channels,
               Index points, Index tile_points) noexcept;
  /// One (channels, 3) feature from a rows x 3 matrix.
  void vector(const char* prefix, const char* name, const float* feature, Index rows,
              Index channels) noexcept;
  /// `columns` columns of `rows` floats, of which the first `channels` count, as (columns,
  /// channels).
  void matrix(const char* prefix, const char* name, const float* values, Index rows, Index channels,
              Index columns) noexcept;
  void coordinates(const char* prefix, const char* name, const kernels::Coordinates& points,
                   Index count) noexcept;
  void list(const char* prefix, const char* name, const float* values, Index count) noexcept;
  void list(const char* prefix, const char* name, const std::uint32_t* values,
            Index count) noexcept;
  void pose(const char* prefix, const char* name, const kernels::RigidTransform& pose) noexcept;

 private:
  template <class ValueAt>
  void add(const char* prefix, const char* name, std::initializer_list<Index> shape,
           const ValueAt& value_at) noexcept;

  bool enabled_;
  std::vector<Stage> stages_;
};

}  // namespace vnreg::detail
