// Every layout that users have their clouds in gives the same pose, without a copy.
#include <Eigen/Core>
#include <catch2/catch.hpp>
#include <cstring>

#include "clouds.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

struct Xyz {  // as geometry_msgs::Point32
  float x, y, z;
};
struct alignas(16) Padded {  // as pcl::PointXYZ
  union {
    float data[4];
    struct {
      float x, y, z;
    };
  };
};
struct Coloured {  // coordinates behind other fields
  std::uint32_t colour;
  double x, y, z;
  float intensity;
};
struct Apart {  // as an interleaved position and normal
  float x, nx, y, ny, z, nz;
};
struct Backwards {
  float z, y, x;
};

template <class Point>
std::vector<Point> named(const std::vector<std::array<float, 3>>& points) {
  std::vector<Point> result(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    using Scalar = decltype(result[i].x);
    result[i].x = static_cast<Scalar>(points[i][0]);
    result[i].y = static_cast<Scalar>(points[i][1]);
    result[i].z = static_cast<Scalar>(points[i][2]);
  }
  return result;
}

struct Layouts {
  Random random{91};
  std::vector<std::array<float, 3>> points;
  Points target = shape(80, random);
  Registrar registrar{random_model().build(), {.mode = Mode::coarse, .threads = 1}};
  Pose expected;

  Layouts() {
    for (const auto& p : shape(100, random)) {
      points.push_back(
          {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    }
    const Result& result = registrar.align(points, target);
    REQUIRE(result.has_pose);
    expected = result.T_target_source;
  }

  void check(const PointsView& view) {
    REQUIRE(view.size() == points.size());
    REQUIRE(registrar.align(view, target).T_target_source == expected);
  }
};

TEST_CASE_METHOD(Layouts, "ranges of points of many kinds") {
  check(std::span<const std::array<float, 3>>(points));
  check(named<Xyz>(points));
  check(named<Padded>(points));
  check(named<Coloured>(points));
  check(named<Apart>(points));
  std::vector<Eigen::Vector3f> vectors;
  std::vector<Eigen::Vector4f> homogeneous;
  std::array<std::array<double, 4>, 100> doubles{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    vectors.emplace_back(points[i][0], points[i][1], points[i][2]);
    homogeneous.emplace_back(points[i][0], points[i][1], points[i][2], 1.0f);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      doubles[i][axis] = static_cast<double>(points[i][axis]);
    }
  }
  check(vectors);
  check(homogeneous);
  check(doubles);
}

TEST_CASE_METHOD(Layouts, "matrices in both orders") {
  Eigen::Matrix3Xd columns(3, 100);
  Eigen::MatrixX3f rows(100, 3);
  for (Eigen::Index i = 0; i < 100; ++i) {
    const auto& p = points[static_cast<std::size_t>(i)];
    rows.row(i) << p[0], p[1], p[2];
    columns.col(i) = rows.row(i).cast<double>();
  }
  check({columns.data(), 100});
  check({rows.data(), 100, sizeof(float), 100 * sizeof(float)});
}

TEST_CASE_METHOD(Layouts, "bytes of a message, without alignment") {
  constexpr std::size_t step = 19, offset = 5;
  std::vector<std::uint8_t> bytes(offset + step * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(bytes.data() + offset + step * i, points[i].data(), 12);
  }
  check({reinterpret_cast<const float*>(bytes.data() + offset), points.size(), step});
}

TEST_CASE_METHOD(Layouts, "an empty range is an empty cloud") {
  REQUIRE(registrar.align(std::vector<Xyz>{}, target).status == Status::too_few_points);
  REQUIRE(PointsView(std::vector<Eigen::Vector3d>{}).size() == 0);
}

TEST_CASE_METHOD(Layouts, "coordinates in another order are refused") {
  const auto backwards = named<Backwards>(points);
  try {
    const PointsView view(backwards);
    FAIL("accepted");
  } catch (const Error& e) {
    REQUIRE(e.code() == ErrorCode::invalid_points);
    REQUIRE(e.got() == "y at byte -4, z at byte -8");
  }
}

// What only refers to coordinates, or has too few of them, is no point.
static_assert(!std::convertible_to<std::vector<std::span<const float>>, PointsView>);
static_assert(!std::convertible_to<std::vector<std::vector<float>>, PointsView>);
static_assert(!std::convertible_to<std::vector<Eigen::VectorXf>, PointsView>);
static_assert(!std::convertible_to<std::vector<Eigen::Vector2d>, PointsView>);
static_assert(!std::convertible_to<std::vector<const double*>, PointsView>);
static_assert(!std::convertible_to<std::vector<float>, PointsView>);
static_assert(!std::convertible_to<std::vector<std::array<int, 3>>, PointsView>);

}  // namespace
}  // namespace vnreg::test
