// Fast kernels against the naive ones of kernels/reference, on sizes and numbers that the bytes
// choose.
#include <fuzzer/FuzzedDataProvider.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "kernels/fit_rotations.hpp"
#include "kernels/linear.hpp"
#include "kernels/list_within.hpp"
#include "kernels/neighbours.hpp"
#include "kernels/procrustes.hpp"
#include "kernels/reference/dense.hpp"
#include "kernels/reference/neighbours.hpp"
#include "kernels/top_k.hpp"
#include "require.hpp"

namespace vnreg::fuzz {
namespace {

using namespace kernels;

Index size(FuzzedDataProvider& bytes, Index low, Index high) {
  return bytes.ConsumeIntegralInRange<Index>(low, high);
}

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Small whole numbers (ties), numbers of one order, or numbers of many.
std::vector<float> numbers(FuzzedDataProvider& bytes, Index count) {
  const int kind = bytes.ConsumeIntegralInRange(0, 2);
  const auto exponent = bytes.ConsumeIntegralInRange(-60, 50);
  std::vector<float> values(at(count));
  for (float& value : values) {
    if (kind == 0) {
      value = static_cast<float>(bytes.ConsumeIntegralInRange(-3, 3));
    } else {
      value = bytes.ConsumeFloatingPointInRange(-1.0F, 1.0F);
      if (kind == 2) value = std::ldexp(value, exponent);
    }
  }
  return values;
}

struct PointSet {
  std::vector<float> x, y, z;

  PointSet(FuzzedDataProvider& bytes, Index count)
      : x(numbers(bytes, count)), y(numbers(bytes, count)), z(numbers(bytes, count)) {}
  Coordinates coordinates() const { return {x.data(), y.data(), z.data()}; }
};

bool near(double got, double expected, double scale, double tolerance) {
  return std::abs(got - expected) <= tolerance * scale + 1e-37;
}

void check_neighbours(FuzzedDataProvider& bytes) {
  const Index count = size(bytes, 1, 80);
  const Index k = size(bytes, 1, std::min<Index>(count, 64));
  const PointSet points(bytes, count);
  SpatialIndex index(count);
  index.build(points.coordinates(), count);
  NeighbourScratch scratch(count);
  std::vector<std::uint16_t> found(at(k * count));
  std::vector<float> alone(at(count));
  nearest_points(index, k, 0, index.leaves(), scratch, found.data());
  nearest_others(index, 0, index.leaves(), scratch, alone.data());
  for (Index i = 0; i < count; ++i) {
    std::vector<Index> expected = reference::by_distance(points.coordinates(), count, i);
    expected.resize(at(k));
    std::sort(expected.begin(), expected.end());
    std::vector<Index> got(found.begin() + k * i, found.begin() + k * (i + 1));
    std::sort(got.begin(), got.end());
    require(got == expected, "the k nearest points, ties by index");
    require(alone[at(i)] == reference::spacing_squared(points.coordinates(), count, i),
            "the distance to the nearest other point");
  }
}

void check_nearest_distances(FuzzedDataProvider& bytes) {
  const Index count = size(bytes, 1, 80), queries = size(bytes, 1, 80);
  const PointSet points(bytes, count), asked(bytes, queries);
  SpatialIndex index(count);
  index.build(points.coordinates(), count);
  NeighbourScratch scratch(count);
  std::vector<float> squared(at(queries));
  nearest_distances(index, asked.coordinates(), queries, scratch, squared.data());
  for (Index q = 0; q < queries; ++q) {
    require(squared[at(q)] ==
                reference::nearest_distance(points.coordinates(), count, asked.coordinates(), q),
            "the distance to the nearest point");
  }
}

void check_top_k(FuzzedDataProvider& bytes) {
  const std::vector<float> values = numbers(bytes, size(bytes, 1, 100));
  const auto k = bytes.ConsumeIntegralInRange<std::size_t>(0, values.size());
  std::vector<std::uint64_t> scratch(values.size());
  std::vector<std::uint32_t> got(k), expected(values.size());
  top_k(values, scratch, got);
  std::iota(expected.begin(), expected.end(), 0U);
  std::stable_sort(expected.begin(), expected.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return values[a] > values[b]; });
  expected.resize(k);
  require(got == expected, "the k largest, ties by index");
}

void check_list_within(FuzzedDataProvider& bytes) {
  const std::vector<float> values = numbers(bytes, 16 * size(bytes, 1, 20));
  const float limit = bytes.ConsumeFloatingPointInRange(-3.0F, 3.0F);
  std::vector<Index> got, expected;
  for_each_within(values.data(), static_cast<Index>(values.size()), limit,
                  [&](Index i) { got.push_back(i); });
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] <= limit) expected.push_back(static_cast<Index>(i));
  }
  require(got == expected, "what is within the limit");
}

void check_linear(FuzzedDataProvider& bytes) {
  const Index in = size(bytes, 1, 40), out = size(bytes, 1, 40), columns = size(bytes, 1, 20);
  const std::vector<float> w = numbers(bytes, out * in), b = numbers(bytes, out);
  const std::vector<float> x = numbers(bytes, in * columns);
  const Linear layer(Eigen::Map<const RowMajorMatrix>(w.data(), out, in), b);
  Floats y(at(layer.padded_rows() * columns));
  linear(layer, x.data(), in, columns, y.data());
  for (Index column = 0; column < columns; ++column) {
    const reference::Row input(x.begin() + in * column, x.begin() + in * (column + 1));
    const reference::Row expected = reference::linear(w, b, input);
    for (Index o = 0; o < out; ++o) {
      double scale = std::abs(static_cast<double>(b[at(o)]));
      for (Index i = 0; i < in; ++i) {
        scale += std::abs(static_cast<double>(w[at(o * in + i)]) * input[at(i)]);
      }
      const auto got = static_cast<double>(y[at(layer.padded_rows() * column + o)]);
      require(near(got, expected[at(o)], scale, 1e-5), "a linear layer");
    }
  }
}

void check_fit(FuzzedDataProvider& bytes) {
  MatrixBatch h{}, rotation{};
  bool determined[MatrixBatch::capacity];
  const Index count = size(bytes, 1, 8);
  for (Index i = 0; i < count; ++i) {
    const std::vector<float> entries = numbers(bytes, 9);
    for (std::size_t e = 0; e < 9; ++e) h.entry[e][i] = static_cast<double>(entries[e]);
  }
  fit_rotations(h, count, rotation, determined);
  for (Index i = 0; i < count; ++i) {
    if (!determined[i]) continue;
    Eigen::Matrix3d matrix, got;
    for (Index e = 0; e < 9; ++e) {
      matrix(e / 3, e % 3) = h.entry[e][i];
      got(e / 3, e % 3) = rotation.entry[e][i];
    }
    require((got * got.transpose()).isIdentity(1e-9), "a fitted rotation is orthonormal");
    require(std::abs(got.determinant() - 1) < 1e-9, "a fitted rotation is no reflection");
    const RotationFit best = fit_rotation(matrix);
    const double trace = (got.transpose() * matrix).trace();
    const double most = (best.rotation.transpose() * matrix).trace();
    require(near(trace, most, best.singular_values.sum(), 1e-6), "the rotation that fits best");
  }
}

void check_one(FuzzedDataProvider& bytes) {
  switch (bytes.ConsumeIntegralInRange(0, 5)) {
    case 0:
      return check_neighbours(bytes);
    case 1:
      return check_nearest_distances(bytes);
    case 2:
      return check_top_k(bytes);
    case 3:
      return check_list_within(bytes);
    case 4:
      return check_linear(bytes);
    default:
      return check_fit(bytes);
  }
}

}  // namespace
}  // namespace vnreg::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider bytes(data, size);
  vnreg::fuzz::check_one(bytes);
  return 0;
}
