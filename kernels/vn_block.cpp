#include "kernels/vn_block.hpp"

#include <algorithm>

#include "kernels/vn_relu.hpp"

namespace vnreg::kernels {
namespace {

using StoredMatrix = Eigen::Map<const RowMajorMatrix>;

StoredMatrix stored(std::span<const float> values, Index rows, Index cols) {
  return {values.data(), rows, cols};
}

/// Splits the channels [v; m] into two halves, each padded to whole packets.
RowMajorMatrix pad_halves_of_columns(const StoredMatrix& w) {
  const Index half = w.cols() / 2;
  RowMajorMatrix out = RowMajorMatrix::Zero(w.rows(), 2 * padded(half));
  out.leftCols(half) = w.leftCols(half);
  out.middleCols(padded(half), half) = w.rightCols(half);
  return out;
}

RowMajorMatrix pad_halves_of_rows(const RowMajorMatrix& w) {
  const Index half = w.rows() / 2;
  RowMajorMatrix out = RowMajorMatrix::Zero(2 * padded(half), w.cols());
  out.topRows(half) = w.topRows(half);
  out.middleRows(padded(half), half) = w.bottomRows(half);
  return out;
}

RowMajorMatrix shortcut_matrix(const VnBlockTensors& t) {
  if (t.shortcut.empty()) return RowMajorMatrix::Identity(t.out, t.in);
  return stored(t.shortcut, t.out, t.in);
}

/// One direction per channel in the padded order of [v; m], or the one shared row.
RowMajorMatrix direction0_matrix(const VnBlockTensors& t) {
  const RowMajorMatrix u = stored(t.relu0, t.shared_direction ? 1 : t.in, t.in);
  return t.shared_direction ? u : pad_halves_of_rows(u);
}

VnBlockTail make_tail(const VnBlockTensors& t) {
  const Index h = t.hidden();
  return {t.shared_direction, PackedMatrix(pad_halves_of_columns(stored(t.fc0, h, t.in))),
          PackedMatrix(stored(t.relu1, t.shared_direction ? 1 : h, h)),
          PackedMatrix(stored(t.fc1, t.out, h))};
}

/// float32 result of a product computed in float64: composed weights lose nothing.
RowMajorMatrix compose(const RowMajorMatrix& a, const RowMajorMatrix& b) {
  return (a.cast<double>() * b.cast<double>()).cast<float>();
}

void grow(Floats& buffer, Index size) {
  buffer.resize(std::max(buffer.size(), static_cast<std::size_t>(size)), 0.0f);
}

/// scratch.activated = relu0(V) is there; computes relu1(F0 relu0(V)).
void finish_hidden(const VnBlockTail& tail, Index half, Index points, VnScratch& s) noexcept {
  const Index rows = tail.hidden_rows();
  const Index columns = 3 * points;
  multiply(tail.fc0, s.activated.data(), 2 * half, columns, s.hidden.data(), rows);
  const VectorsView hidden = tile_view<const float>(s.hidden.data(), rows, points);
  const MutableVectorsView out = tile_view(s.activated_hidden.data(), rows, points);
  if (tail.shared_direction) {
    multiply(tail.direction1, s.hidden.data(), rows, columns, s.direction.data(), packet_size);
    vn_relu_shared(points, rows, hidden,
                   tile_view<const float>(s.direction.data(), packet_size, points), out);
  } else {
    multiply(tail.direction1, s.hidden.data(), rows, columns, out.data, rows);
    vn_relu(points, rows, hidden, out);
  }
}

}  // namespace

VnBlock make_vn_block(const VnBlockTensors& t) {
  const Index half = t.in / 2;
  const RowMajorMatrix u = direction0_matrix(t);
  const RowMajorMatrix s = shortcut_matrix(t);
  return {padded(half),
          PackedMatrix(u.leftCols(half)),
          PackedMatrix(u.rightCols(half)),
          PackedMatrix(s.leftCols(half)),
          PackedMatrix(s.rightCols(half)),
          make_tail(t)};
}

EdgeBlock make_edge_block(std::span<const float> pre, const VnBlockTensors& t) {
  const RowMajorMatrix p = stored(pre, t.in, 3);
  return {padded(t.in / 2), PackedMatrix(pad_halves_of_rows(p)),
          PackedMatrix(compose(direction0_matrix(t), p)),
          PackedMatrix(compose(shortcut_matrix(t), p)), make_tail(t)};
}

void VnBlockConstants::reserve(const VnBlock& block) {
  grow(m, 3 * block.half);
  grow(direction0, 3 * block.direction0_m.padded_rows());
  grow(shortcut, 3 * block.out_rows());
}

void set_constants(const VnBlock& block, const float* m, VnBlockConstants& constants) noexcept {
  std::copy_n(m, 3 * block.half, constants.m.data());
  multiply(block.direction0_m, m, block.half, 3, constants.direction0.data(),
           block.direction0_m.padded_rows());
  multiply(block.shortcut_m, m, block.half, 3, constants.shortcut.data(), block.out_rows());
}

void VnScratch::reserve(Index half, const VnBlockTail& tail, Index points) {
  grow(lifted, 2 * half * 3 * points);
  grow(activated, 2 * half * 3 * points);
  grow(hidden, tail.hidden_rows() * 3 * points);
  grow(activated_hidden, tail.hidden_rows() * 3 * points);
  grow(direction, packet_size * 3 * points);
}

void vn_block_hidden(const VnBlock& block, const VnBlockConstants& constants, const float* v,
                     Index points, VnScratch& scratch) noexcept {
  const Index half = block.half;
  const VectorsView v_view = tile_view(v, half, points);
  const VectorsView m_view{constants.m.data(), 0, half};
  const MutableVectorsView v_out = tile_view(scratch.activated.data(), 2 * half, points);
  const MutableVectorsView m_out{v_out.data + half, v_out.point_stride, v_out.component_stride};
  const Index direction_rows = block.direction0_v.padded_rows();
  if (block.tail.shared_direction) {
    float* direction = scratch.direction.data();
    multiply_bias(block.direction0_v, v, half, 3 * points, direction, direction_rows,
                  constants.direction0.data(), direction_rows, points);
    const VectorsView d = tile_view<const float>(direction, direction_rows, points);
    vn_relu_shared(points, half, v_view, d, v_out);
    vn_relu_shared(points, half, m_view, d, m_out);
  } else {
    multiply_bias(block.direction0_v, v, half, 3 * points, v_out.data, direction_rows,
                  constants.direction0.data(), direction_rows, points);
    vn_relu(points, half, v_view, v_out);
    vn_relu(points, half, m_view, m_out);
  }
  finish_hidden(block.tail, half, points, scratch);
}

void vn_block(const VnBlock& block, const VnBlockConstants& constants, const float* v, Index points,
              VnScratch& scratch, float* out) noexcept {
  vn_block_hidden(block, constants, v, points, scratch);
  const Index rows = block.out_rows();
  multiply_bias(block.shortcut_v, v, block.half, 3 * points, out, rows, constants.shortcut.data(),
                rows, points);
  multiply_add(block.tail.fc1, scratch.activated_hidden.data(), block.tail.hidden_rows(),
               3 * points, out, rows);
}

void edge_block(const EdgeBlock& block, const float* edges, Index points, VnScratch& scratch,
                float* out) noexcept {
  const Index columns = 3 * points;
  const Index wide = 2 * block.half;
  float* lifted = scratch.lifted.data();
  multiply(block.input, edges, 3, columns, lifted, wide);
  const MutableVectorsView activated = tile_view(scratch.activated.data(), wide, points);
  if (block.tail.shared_direction) {
    multiply(block.direction0, edges, 3, columns, scratch.direction.data(), packet_size);
    vn_relu_shared(points, wide, tile_view<const float>(lifted, wide, points),
                   tile_view<const float>(scratch.direction.data(), packet_size, points),
                   activated);
  } else {
    multiply(block.direction0, edges, 3, columns, activated.data, wide);
    vn_relu(points, wide, tile_view<const float>(lifted, wide, points), activated);
  }
  finish_hidden(block.tail, block.half, points, scratch);
  multiply(block.shortcut, edges, 3, columns, out, block.out_rows());
  multiply_add(block.tail.fc1, scratch.activated_hidden.data(), block.tail.hidden_rows(), columns,
               out, block.out_rows());
}

}  // namespace vnreg::kernels
