// Vector-neuron layers written as the paper writes them, in float64 and torch's layout. For tests.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "kernels/vn_block.hpp"

namespace vnreg::kernels::reference {

/// (points, channels, 3).
struct Vectors {
  Index points = 0;
  Index channels = 0;
  std::vector<double> values;

  Vectors(Index p, Index c)
      : points(p), channels(c), values(static_cast<std::size_t>(p * c * 3), 0.0) {}

  double& at(Index p, Index c, Index axis) {
    return values[static_cast<std::size_t>((p * channels + c) * 3 + axis)];
  }
  double at(Index p, Index c, Index axis) const {
    return values[static_cast<std::size_t>((p * channels + c) * 3 + axis)];
  }
};

/// `w` is (out, v.channels), row-major.
inline Vectors vn_linear(std::span<const float> w, Index out, const Vectors& v) {
  Vectors result(v.points, out);
  for (Index p = 0; p < v.points; ++p) {
    for (Index o = 0; o < out; ++o) {
      for (Index c = 0; c < v.channels; ++c) {
        const auto weight = static_cast<double>(w[static_cast<std::size_t>(o * v.channels + c)]);
        for (Index axis = 0; axis < 3; ++axis) result.at(p, o, axis) += weight * v.at(p, c, axis);
      }
    }
  }
  return result;
}

/// v where <v,d> >= 0, else v - <v,d> / (|d|^2 + 1e-7) d; `d` has v's channels, or one for all.
inline Vectors clip_to_half_space(const Vectors& v, const Vectors& d) {
  Vectors result = v;
  for (Index p = 0; p < v.points; ++p) {
    for (Index c = 0; c < v.channels; ++c) {
      const Index from = d.channels == 1 ? 0 : c;
      double dot = 0;
      double squared = 0;
      for (Index axis = 0; axis < 3; ++axis) {
        dot += v.at(p, c, axis) * d.at(p, from, axis);
        squared += d.at(p, from, axis) * d.at(p, from, axis);
      }
      if (dot >= 0) continue;
      for (Index axis = 0; axis < 3; ++axis) {
        result.at(p, c, axis) -= dot / (squared + 1e-7) * d.at(p, from, axis);
      }
    }
  }
  return result;
}

inline Vectors vn_relu(std::span<const float> u, bool shared_direction, const Vectors& v) {
  return clip_to_half_space(v, vn_linear(u, shared_direction ? 1 : v.channels, v));
}

/// (1, channels, 3).
inline Vectors mean(const Vectors& v) {
  Vectors result(1, v.channels);
  for (Index p = 0; p < v.points; ++p) {
    for (Index c = 0; c < v.channels; ++c) {
      for (Index axis = 0; axis < 3; ++axis) {
        result.at(0, c, axis) += v.at(p, c, axis) / static_cast<double>(v.points);
      }
    }
  }
  return result;
}

/// [v; m] with the one feature m expanded to every point.
inline Vectors concatenate(const Vectors& v, const Vectors& m) {
  Vectors result(v.points, v.channels + m.channels);
  for (Index p = 0; p < v.points; ++p) {
    for (Index c = 0; c < result.channels; ++c) {
      for (Index axis = 0; axis < 3; ++axis) {
        result.at(p, c, axis) = c < v.channels ? v.at(p, c, axis) : m.at(0, c - v.channels, axis);
      }
    }
  }
  return result;
}

inline Vectors vn_block(const VnBlockTensors& t, const Vectors& v) {
  const Vectors activated = vn_relu(t.relu0, t.shared_direction, v);
  const Vectors hidden = vn_linear(t.fc0, t.hidden(), activated);
  Vectors result = vn_linear(t.fc1, t.out, vn_relu(t.relu1, t.shared_direction, hidden));
  const Vectors shortcut = t.shortcut.empty() ? v : vn_linear(t.shortcut, t.out, v);
  for (std::size_t i = 0; i < result.values.size(); ++i) result.values[i] += shortcut.values[i];
  return result;
}

/// p = W v; n = |p| + 1e-7; q = (p / n)(scale n + shift); VN-ReLU of q with direction U v.
inline Vectors vn_norm_layer(std::span<const float> fc, std::span<const float> direction,
                             std::span<const float> scale, std::span<const float> shift,
                             bool shared_direction, const Vectors& v) {
  const auto out = static_cast<Index>(scale.size());
  Vectors q = vn_linear(fc, out, v);
  for (Index p = 0; p < q.points; ++p) {
    for (Index c = 0; c < out; ++c) {
      const double n = std::sqrt(q.at(p, c, 0) * q.at(p, c, 0) + q.at(p, c, 1) * q.at(p, c, 1) +
                                 q.at(p, c, 2) * q.at(p, c, 2)) +
                       1e-7;
      const auto at = static_cast<std::size_t>(c);
      const double factor =
          (static_cast<double>(scale[at]) * n + static_cast<double>(shift[at])) / n;
      for (Index axis = 0; axis < 3; ++axis) q.at(p, c, axis) *= factor;
    }
  }
  return clip_to_half_space(q, vn_linear(direction, shared_direction ? 1 : out, v));
}

}  // namespace vnreg::kernels::reference
