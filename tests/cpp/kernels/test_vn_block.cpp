#include "kernels/vn_block.hpp"

#include <Eigen/Geometry>

#include "helpers.hpp"

namespace vnreg::kernels::test {
namespace {

/// A block with weights of its own.
struct RandomBlock {
  std::vector<float> relu0, fc0, relu1, fc1, shortcut;
  VnBlockTensors tensors;

  RandomBlock(Index in, Index out, bool shared, Random& random) {
    tensors.in = in;
    tensors.out = out;
    tensors.shared_direction = shared;
    const Index hidden = tensors.hidden();
    relu0 = random.weights(shared ? 1 : in, in);
    fc0 = random.weights(hidden, in);
    relu1 = random.weights(shared ? 1 : hidden, hidden);
    fc1 = random.weights(out, hidden);
    if (in != out) shortcut = random.weights(out, in);
    tensors.relu0 = relu0;
    tensors.fc0 = fc0;
    tensors.relu1 = relu1;
    tensors.fc1 = fc1;
    tensors.shortcut = shortcut;
  }
};

struct Widths {
  Index half, out;
};
constexpr Widths widths[] = {{1, 1},  {1, 2},   {3, 5},   {5, 3},   {5, 10},  {16, 16},
                             {8, 64}, {32, 64}, {47, 48}, {48, 47}, {64, 64}, {128, 128}};

TEST_CASE("a block on [v; m] equals the naive block on the concatenation") {
  Random random(21);
  for (const Widths w : widths) {
    for (const bool shared : {false, true}) {
      const RandomBlock b(2 * w.half, w.out, shared, random);
      const VnBlock block = make_vn_block(b.tensors);
      VnBlockConstants constants;
      constants.reserve(block);
      for (const Index points : {1, 2, 3, 7, 32, 65}) {
        const reference::Vectors v = random.vectors(points, w.half);
        const reference::Vectors m = random.vectors(1, w.half);
        const reference::Vectors expected =
            reference::vn_block(b.tensors, reference::concatenate(v, m));
        VnScratch scratch;
        scratch.reserve(block.half, block.tail, points);
        set_constants(block, to_tile(m).data(), constants);
        GuardedFloats out(block.out_rows() * 3 * points);
        vn_block(block, constants, to_tile(v).data(), points, scratch, out.data());
        CAPTURE(w.half, w.out, shared, points);
        REQUIRE(out.intact());
        REQUIRE(tile_error(out.data(), expected) < 5e-6);
      }
    }
  }
}

TEST_CASE("the hidden half of a block, whose linear maps move behind a mean pool") {
  Random random(22);
  const RandomBlock b(2 * 47, 47, false, random);
  const VnBlock block = make_vn_block(b.tensors);
  VnBlockConstants constants;
  constants.reserve(block);
  const reference::Vectors v = random.vectors(33, 47);
  const reference::Vectors m = random.vectors(1, 47);
  VnScratch scratch;
  scratch.reserve(block.half, block.tail, 33);
  set_constants(block, to_tile(m).data(), constants);
  vn_block_hidden(block, constants, to_tile(v).data(), 33, scratch);
  const reference::Vectors activated =
      reference::vn_relu(b.relu0, false, reference::concatenate(v, m));
  const reference::Vectors expected =
      reference::vn_relu(b.relu1, false, reference::vn_linear(b.fc0, 47, activated));
  REQUIRE(tile_error(scratch.activated_hidden.data(), expected) < 5e-6);
}

TEST_CASE("the first block, folded through its linear layer, equals both in a row") {
  Random random(23);
  for (const Index channels : {1, 3, 5, 16, 47, 48, 128}) {
    for (const bool shared : {false, true}) {
      const std::vector<float> pre = random.weights(2 * channels, 3);
      const RandomBlock b(2 * channels, channels, shared, random);
      const EdgeBlock block = make_edge_block(pre, b.tensors);
      for (const Index points : {1, 2, 7, 63}) {
        const reference::Vectors edges = random.vectors(points, 3);
        const reference::Vectors expected =
            reference::vn_block(b.tensors, reference::vn_linear(pre, 2 * channels, edges));
        Floats columns(static_cast<std::size_t>(9 * points));  // three rows, not padded
        for (Index p = 0; p < points; ++p) {
          for (Index e = 0; e < 3; ++e) {
            for (Index axis = 0; axis < 3; ++axis) {
              columns[static_cast<std::size_t>((axis * points + p) * 3 + e)] =
                  static_cast<float>(edges.at(p, e, axis));
            }
          }
        }
        VnScratch scratch;
        scratch.reserve(block.half, block.tail, points);
        GuardedFloats out(block.out_rows() * 3 * points);
        edge_block(block, columns.data(), points, scratch, out.data());
        CAPTURE(channels, shared, points);
        REQUIRE(out.intact());
        REQUIRE(tile_error(out.data(), expected) < 5e-6);
      }
    }
  }
}

TEST_CASE("blocks commute with rotation") {
  Random random(24);
  const RandomBlock b(2 * 48, 16, false, random);
  const VnBlock block = make_vn_block(b.tensors);
  const Eigen::Matrix3d r = Eigen::Quaterniond(0.3, -0.5, 0.1, 0.8).normalized().toRotationMatrix();
  const auto rotated = [&r](const reference::Vectors& v) {
    reference::Vectors out(v.points, v.channels);
    for (Index i = 0; i < v.points * v.channels; ++i) {
      Eigen::Map<Eigen::Vector3d>(out.values.data() + 3 * i) =
          r * Eigen::Map<const Eigen::Vector3d>(v.values.data() + 3 * i);
    }
    return out;
  };
  const auto run = [&](const reference::Vectors& v, const reference::Vectors& m) {
    VnBlockConstants constants;
    constants.reserve(block);
    VnScratch scratch;
    scratch.reserve(block.half, block.tail, v.points);
    set_constants(block, to_tile(m).data(), constants);
    Floats out(static_cast<std::size_t>(block.out_rows() * 3 * v.points));
    vn_block(block, constants, to_tile(v).data(), v.points, scratch, out.data());
    reference::Vectors result(v.points, 16);
    for (Index p = 0; p < v.points; ++p) {
      for (Index c = 0; c < 16; ++c) {
        for (Index axis = 0; axis < 3; ++axis) {
          result.at(p, c, axis) = static_cast<double>(
              out[static_cast<std::size_t>((axis * v.points + p) * block.out_rows() + c)]);
        }
      }
    }
    return result;
  };
  const reference::Vectors v = random.vectors(63, 48);
  const reference::Vectors m = random.vectors(1, 48);
  REQUIRE(tile_error(to_tile(run(rotated(v), rotated(m))).data(), rotated(run(v, m))) < 1e-5);
}

}  // namespace
}  // namespace vnreg::kernels::test
