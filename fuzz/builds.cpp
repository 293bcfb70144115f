// The builds for x86-64-v2, v3 and v4 side by side, on clouds that the bytes describe: they round
// differently and must mean the same. The paths of the shared libraries stand in the environment
// variable VNREG_FUZZ_LIBRARIES, separated by colons.
#include <dlfcn.h>
#include <fuzzer/FuzzedDataProvider.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "require.hpp"
#include "vnreg/vnreg.h"

namespace vnreg::fuzz {
namespace {

using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

constexpr double largest_angle_deg = 0.1;

/// One build, in a name space of its own.
class Build {
 public:
  explicit Build(const std::string& path)
      : library_(::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    require(library_ != nullptr, "the library can be loaded");
    const auto create = function<decltype(vnreg_registrar_create)>("vnreg_registrar_create");
    for (const vnreg_mode mode : {VNREG_MODE_COARSE, VNREG_MODE_VERIFIED}) {
      vnreg_options options = VNREG_DEFAULT_OPTIONS;
      options.mode = mode;
      options.threads = 1;
      options.max_points = 128;
      vnreg_registrar*& registrar = mode == VNREG_MODE_COARSE ? coarse_ : verified_;
      require(create(nullptr, &options, &registrar, nullptr) == VNREG_OK, "a registrar");
    }
    align_ = function<decltype(vnreg_registrar_align)>("vnreg_registrar_align");
  }

  vnreg_result align(bool coarse, const std::vector<double>& source,
                     const std::vector<double>& target) const {
    vnreg_result result;
    const vnreg_cloud clouds[2] = {view(source), view(target)};
    const vnreg_code code =
        align_(coarse ? coarse_ : verified_, clouds[0], clouds[1], &result, nullptr);
    require(code == VNREG_OK, "a call succeeds");
    return result;
  }

 private:
  template <class Function>
  Function* function(const char* name) const {
    return reinterpret_cast<Function*>(::dlsym(library_, name));
  }
  static vnreg_cloud view(const std::vector<double>& xyz) {
    vnreg_cloud cloud{};
    cloud.data = xyz.data();
    cloud.count = xyz.size() / 3;
    cloud.scalar = VNREG_FLOAT64;
    return cloud;
  }

  void* library_;
  vnreg_registrar* coarse_ = nullptr;
  vnreg_registrar* verified_ = nullptr;
  decltype(vnreg_registrar_align)* align_ = nullptr;
};

const std::vector<Build>& builds() {
  // Never destroyed: the leak check comes after the end of what is static.
  static const std::vector<Build>& all =
      [] {
        auto& made = *new std::vector<Build>;
        const char* paths = std::getenv("VNREG_FUZZ_LIBRARIES");
        std::istringstream text(paths == nullptr ? "" : paths);
        for (std::string path; std::getline(text, path, ':');) made.emplace_back(path);
        require(made.size() >= 2, "VNREG_FUZZ_LIBRARIES names two builds or more");
        return std::ref(made);
      }()
          .get();
  return all;
}

/// A lopsided body, whose pose is determined: its shape, size, place and density from the bytes.
struct Body {
  double axis[3], bump[3], offset[3], scale;

  explicit Body(FuzzedDataProvider& bytes) {
    for (double& a : axis) a = bytes.ConsumeFloatingPointInRange(0.2, 1.0);
    for (double& b : bump) b = bytes.ConsumeFloatingPointInRange(0.15, 0.45);
    for (double& o : offset) o = bytes.ConsumeFloatingPointInRange(-1e4, 1e4);
    scale = std::ldexp(1.0, bytes.ConsumeIntegralInRange(-40, 40));
  }

  std::vector<double> sample(FuzzedDataProvider& bytes) const {
    std::mt19937 random(bytes.ConsumeIntegral<unsigned>());
    std::normal_distribution<double> normal;
    std::vector<double> xyz(3 * bytes.ConsumeIntegralInRange<std::size_t>(48, 200));
    for (std::size_t i = 0; i < xyz.size(); i += 3) {
      const Eigen::Vector3d v =
          Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      const double radius =
          1 + bump[0] * v.x() * v.y() + bump[1] * v.z() * v.z() * v.z() + bump[2] * v.x();
      for (Eigen::Index a = 0; a < 3; ++a) {
        xyz[i + static_cast<std::size_t>(a)] = scale * (axis[a] * radius * v(a) + offset[a]);
      }
    }
    return xyz;
  }
};

Eigen::Matrix3d rotation(const double* T) {
  return Eigen::Map<const Matrix4>(T).topLeftCorner<3, 3>();
}

/// From rotation a to rotation b, in the target's frame, in radians.
Eigen::Vector3d turn_between(const double* a, const double* b) {
  const Eigen::AngleAxisd turn(rotation(b) * rotation(a).transpose());
  return turn.angle() * turn.axis();
}

double angle_deg(const double* a, const double* b) {
  return turn_between(a, b).norm() * 180 / std::numbers::pi;
}

/// Whether b lies within one standard deviation of the rotation of a, along every axis as far as a
/// itself says how flat its optimum is there. False where it says nothing.
bool within_deviation(const vnreg_result& a, const vnreg_result& b) {
  const Eigen::Matrix3d covariance =
      Eigen::Map<const Eigen::Matrix<double, 6, 6>>(a.covariance).topLeftCorner<3, 3>();
  if (!covariance.allFinite()) return false;
  const Eigen::Vector3d turn = turn_between(a.T_target_source, b.T_target_source);
  return turn.dot(covariance.ldlt().solve(turn)) <= 1;
}

/// The same pose, or one as near as a flat optimum is told to be wide, or one that the other build
/// ranks beside its own.
bool agrees(const vnreg_result& a, const vnreg_result& b) {
  if (angle_deg(a.T_target_source, b.T_target_source) <= largest_angle_deg) return true;
  if (within_deviation(a, b)) return true;
  for (std::size_t i = 0; i < b.alternative_count; ++i) {
    if (angle_deg(a.T_target_source, b.alternatives[i].T_target_source) <= 1) return true;
  }
  return false;
}

void compare(FuzzedDataProvider& bytes) {
  const bool coarse = bytes.ConsumeIntegralInRange(0, 3) != 0;
  const Body body(bytes);
  const std::vector<double> source = body.sample(bytes), target = body.sample(bytes);
  const vnreg_result expected = builds().front().align(coarse, source, target);
  for (const Build& build : builds()) {
    const vnreg_result got = build.align(coarse, source, target);
    require(got.has_pose == expected.has_pose, "every build finds a pose, or none");
    if (!got.has_pose) continue;
    require(agrees(got, expected) || agrees(expected, got), "every build finds the same pose");
    // Of symmetric shapes the first of two poses may be another; what they are worth is the same.
    require(coarse || std::abs(got.confidence - expected.confidence) < 0.2, "and is as sure");
  }
}

}  // namespace
}  // namespace vnreg::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider bytes(data, size);
  vnreg::fuzz::compare(bytes);
  return 0;
}
