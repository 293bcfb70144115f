#include "engine/stage_recorder.hpp"

#include <algorithm>

namespace vnreg::detail {

void StageRecorder::clear() noexcept { stages_.clear(); }

template <class ValueAt>
void StageRecorder::add(const char* prefix, const char* name, std::initializer_list<Index> shape,
                        const ValueAt& value_at) noexcept {
  if (!enabled_) return;
  try {
    Stage stage;
    stage.name = std::string(prefix) + name;
    std::size_t count = 1;
    for (const Index extent : shape) {
      stage.shape.push_back(static_cast<std::size_t>(extent));
      count *= static_cast<std::size_t>(extent);
    }
    stage.values.resize(count);
    for (std::size_t i = 0; i < count; ++i) stage.values[i] = value_at(static_cast<Index>(i));
    stages_.push_back(std::move(stage));
  } catch (const std::exception&) {
    clear();
  }
}

void StageRecorder::vectors(const char* prefix, const char* name, const float* tiles, Index rows,
                            Index channels, Index points, Index tile_points) noexcept {
  add(prefix, name, {points, channels, 3}, [=](Index i) {
    const Index component = i % 3;
    const Index channel = i / 3 % channels;
    const Index point = i / (3 * channels);
    const Index first = point / tile_points * tile_points;
    const Index width = std::min(tile_points, points - first);
    return static_cast<double>(
        tiles[(3 * first + component * width + point - first) * rows + channel]);
  });
}

void StageRecorder::vector(const char* prefix, const char* name, const float* feature, Index rows,
                           Index channels) noexcept {
  add(prefix, name, {channels, 3},
      [=](Index i) { return static_cast<double>(feature[i % 3 * rows + i / 3]); });
}

void StageRecorder::matrix(const char* prefix, const char* name, const float* values, Index rows,
                           Index channels, Index columns) noexcept {
  add(prefix, name, {columns, channels},
      [=](Index i) { return static_cast<double>(values[i / channels * rows + i % channels]); });
}

void StageRecorder::coordinates(const char* prefix, const char* name,
                                const kernels::Coordinates& points, Index count) noexcept {
  add(prefix, name, {count, 3}, [=](Index i) {
    const float* axes[3] = {points.x, points.y, points.z};
    return static_cast<double>(axes[i % 3][i / 3]);
  });
}

void StageRecorder::list(const char* prefix, const char* name, const float* values,
                         Index count) noexcept {
  add(prefix, name, {count}, [=](Index i) { return static_cast<double>(values[i]); });
}

void StageRecorder::list(const char* prefix, const char* name, const std::uint32_t* values,
                         Index count) noexcept {
  add(prefix, name, {count}, [=](Index i) { return static_cast<double>(values[i]); });
}

void StageRecorder::pose(const char* prefix, const char* name,
                         const kernels::RigidTransform& pose) noexcept {
  add(prefix, name, {4, 4}, [&pose](Index i) {
    const Index row = i / 4;
    const Index column = i % 4;
    if (row == 3) return column == 3 ? 1.0 : 0.0;
    return column == 3 ? pose.translation(row) : pose.rotation(row, column);
  });
}

}  // namespace vnreg::detail
