// VN-ReLU with slope 0 (paper, section III-A): per channel, a vector that points against its
// learned direction d loses its part along d:
//   v if <v, d> >= 0, else v - <v, d> / (|d|^2 + 1e-7) d.
#pragma once

#include "kernels/packets.hpp"

namespace vnreg::kernels {

inline constexpr float vn_epsilon = 1e-7f;

/// Vector features of a tile: channel c of component a (x, y, z) of point p is
/// data[p * point_stride + a * component_stride + c]. With point_stride 0 all points share them.
template <class Scalar>
struct VectorsOf {
  Scalar* data;
  Index point_stride;
  Index component_stride;

  Scalar* at(Index point, Index component) const noexcept {
    return data + point * point_stride + component * component_stride;
  }
};
using VectorsView = VectorsOf<const float>;
using MutableVectorsView = VectorsOf<float>;

/// The view of a whole tile of `points` points and column stride `stride`.
template <class Scalar>
VectorsOf<Scalar> tile_view(Scalar* data, Index stride, Index points) noexcept {
  return {data, stride, points * stride};
}

/// `d` holds one direction per channel and is overwritten with the result.
void vn_relu(Index points, Index channels, VectorsView v, MutableVectorsView d) noexcept;

/// `d` holds one direction per point (its channel 0) for all channels; the result goes to `out`,
/// which may be `v`.
void vn_relu_shared(Index points, Index channels, VectorsView v, VectorsView d,
                    MutableVectorsView out) noexcept;

}  // namespace vnreg::kernels
