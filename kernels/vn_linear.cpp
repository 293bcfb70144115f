#include "kernels/vn_linear.hpp"

#include <algorithm>
#include <utility>

namespace vnreg::kernels {
namespace {

using Eigen::internal::padd;
using Eigen::internal::pload;
using Eigen::internal::ploadu;
using Eigen::internal::pmadd;
using Eigen::internal::pset1;
using Eigen::internal::pstoreu;

constexpr Index panel_packets = 2;
constexpr Index panel_rows = panel_packets * packet_size;
// panel_packets * block_columns accumulators, two weights and one broadcast fill the registers:
// 16 of them, or 32 with AVX-512.
constexpr Index block_columns = packet_size == 16 ? 12 : 6;

enum class AddTo { nothing, output, bias };

struct Operands {
  const float* x;
  Index x_stride;
  float* y;
  Index y_stride;
  const float* bias;
  Index bias_stride;
  Index columns_per_bias;
};

/// The column of the bias that belongs to column `j`.
inline const float* bias_column(const Operands& o, Index j) noexcept {
  const Index step = (j >= o.columns_per_bias ? 1 : 0) + (j >= 2 * o.columns_per_bias ? 1 : 0);
  return o.bias + step * o.bias_stride;
}

/// One block of Packets * packet_size rows from `row` and Columns columns from `column`. What the
/// sums are added to joins them last: it may be large beside the terms, and would round each of
/// them.
template <Index Packets, Index Columns, AddTo To>
inline void multiply_block(const float* w, Index depth, const Operands& o, Index row,
                           Index column) noexcept {
  Packet sum[Columns][Packets];
  for (Index j = 0; j < Columns; ++j) {
    for (Index i = 0; i < Packets; ++i) sum[j][i] = pset1<Packet>(0.0f);
  }
  const float* x = o.x + column * o.x_stride;
  for (Index k = 0; k < depth; ++k, w += Packets * packet_size) {
    Packet a[Packets];
    for (Index i = 0; i < Packets; ++i) a[i] = pload<Packet>(w + i * packet_size);
    for (Index j = 0; j < Columns; ++j) {
      const Packet b = pset1<Packet>(x[j * o.x_stride + k]);
      for (Index i = 0; i < Packets; ++i) sum[j][i] = pmadd(a[i], b, sum[j][i]);
    }
  }
  for (Index j = 0; j < Columns; ++j) {
    float* y = o.y + (column + j) * o.y_stride + row;
    const float* base = To == AddTo::bias ? bias_column(o, column + j) + row : y;
    for (Index i = 0; i < Packets; ++i) {
      Packet result = sum[j][i];
      if constexpr (To != AddTo::nothing) {
        result = padd(result, ploadu<Packet>(base + i * packet_size));
      }
      pstoreu(y + i * packet_size, result);
    }
  }
}

/// The last columns of a panel, fewer than block_columns: picks the block of exactly that width.
template <Index Packets, AddTo To, std::size_t... Width>
inline void multiply_last_columns(const float* w, Index depth, const Operands& o, Index row,
                                  Index column, Index left,
                                  std::index_sequence<Width...>) noexcept {
  (void)((left == Index{Width} + 1 &&
          (multiply_block<Packets, Index{Width} + 1, To>(w, depth, o, row, column), true)) ||
         ...);
}

template <Index Packets, AddTo To>
void multiply_panel(const float* w, Index depth, const Operands& o, Index row,
                    Index columns) noexcept {
  Index column = 0;
  for (; column + block_columns <= columns; column += block_columns) {
    multiply_block<Packets, block_columns, To>(w, depth, o, row, column);
  }
  multiply_last_columns<Packets, To>(
      w, depth, o, row, column, columns - column,
      std::make_index_sequence<static_cast<std::size_t>(block_columns - 1)>{});
}

/// Panel by panel: a panel of weights stays in L1 while the columns of the tile stream past it.
template <AddTo To>
void multiply_panels(const PackedMatrix& w, const Operands& o, Index columns) noexcept {
  const Index rows = w.padded_rows();
  const Index depth = w.cols();
  for (Index row = 0; row < rows; row += panel_rows) {
    const float* panel = w.data() + row * depth;
    if (row + panel_rows <= rows) {
      multiply_panel<panel_packets, To>(panel, depth, o, row, columns);
    } else {
      multiply_panel<1, To>(panel, depth, o, row, columns);
    }
  }
}

}  // namespace

PackedMatrix::PackedMatrix(const RowMajorMatrix& weights)
    : rows_(weights.rows()), cols_(weights.cols()) {
  data_.resize(static_cast<std::size_t>(padded_rows() * cols_), 0.0f);
  float* out = data_.data();
  for (Index row = 0; row < padded_rows(); row += panel_rows) {
    const Index height = std::min(panel_rows, padded_rows() - row);
    for (Index k = 0; k < cols_; ++k) {
      for (Index i = 0; i < height; ++i) *out++ = row + i < rows_ ? weights(row + i, k) : 0.0f;
    }
  }
}

void multiply(const PackedMatrix& w, const float* x, Index x_stride, Index columns, float* y,
              Index y_stride) noexcept {
  multiply_panels<AddTo::nothing>(w, {x, x_stride, y, y_stride, nullptr, 0, 0}, columns);
}

void multiply_add(const PackedMatrix& w, const float* x, Index x_stride, Index columns, float* y,
                  Index y_stride) noexcept {
  multiply_panels<AddTo::output>(w, {x, x_stride, y, y_stride, nullptr, 0, 0}, columns);
}

void multiply_bias(const PackedMatrix& w, const float* x, Index x_stride, Index columns, float* y,
                   Index y_stride, const float* bias, Index bias_stride,
                   Index columns_per_bias) noexcept {
  multiply_panels<AddTo::bias>(w, {x, x_stride, y, y_stride, bias, bias_stride, columns_per_bias},
                               columns);
}

}  // namespace vnreg::kernels
