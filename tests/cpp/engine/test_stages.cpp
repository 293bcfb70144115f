// Every recorded stage against the formulas of docs/design.md, written naively in float64 on the
// tensors of the file. Each stage is computed from the recorded stage before it, so that the
// comparison is tight everywhere: errors do not add up and a near tie cannot fork the rest.
#include <catch2/catch.hpp>
#include <map>
#include <numeric>

#include "clouds.hpp"
#include "kernels/reference/dense.hpp"
#include "kernels/reference/neighbours.hpp"
#include "kernels/reference/vn.hpp"
#include "random_model.hpp"

namespace vnreg::test {
namespace {

using kernels::Index;
using kernels::VnBlockTensors;
namespace reference = kernels::reference;
using reference::Row;
using reference::Rows;
using reference::Vectors;

/// max |got - expected| / max |expected| of a recorded stage.
double error(const Stage& got, const std::vector<double>& expected) {
  if (got.values.size() != expected.size()) return std::numeric_limits<double>::infinity();
  double largest = 0;
  double difference = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (!std::isfinite(got.values[i])) return std::numeric_limits<double>::infinity();
    difference = std::max(difference, std::abs(got.values[i] - expected[i]));
    largest = std::max(largest, std::abs(expected[i]));
  }
  return largest > 0 ? difference / largest : difference;
}

std::vector<double> flatten(const Rows& rows) {
  std::vector<double> values;
  for (const Row& row : rows) values.insert(values.end(), row.begin(), row.end());
  return values;
}

class NaiveNetwork {
 public:
  NaiveNetwork(const ModelDraft& draft, const Registrar& registrar, const Widths& widths)
      : draft_(draft), registrar_(registrar), w_(widths) {}

  void check_cloud(const std::string& side) {
    side_ = side;
    check_edges();
    check_encoder();
    check_local_module();
    check_significance();
  }

  void check_pair() {
    check_coarse();
    for (std::uint64_t i = 0; i < w_.fine_iterations; ++i) check_fine_iteration(i);
  }

 private:
  std::span<const float> tensor(const std::string& name) const {
    return draft_.tensors.at(name).values;
  }
  VnBlockTensors block(const std::string& name) const {
    VnBlockTensors t;
    const auto& fc1 = draft_.tensors.at(name + ".fc1");
    t.in = static_cast<Index>(draft_.tensors.at(name + ".relu0").shape[1]);
    t.out = static_cast<Index>(fc1.shape[0]);
    t.shared_direction = w_.shared_direction;
    t.relu0 = tensor(name + ".relu0");
    t.fc0 = tensor(name + ".fc0");
    t.relu1 = tensor(name + ".relu1");
    t.fc1 = tensor(name + ".fc1");
    if (draft_.tensors.contains(name + ".shortcut")) t.shortcut = tensor(name + ".shortcut");
    return t;
  }
  const Stage& recorded(const std::string& name) const {
    return stage(registrar_, side_.empty() ? name : side_ + "." + name);
  }
  Vectors vectors(const std::string& name) const {
    const Stage& s = recorded(name);
    const bool per_point = s.shape.size() == 3;
    Vectors v(per_point ? static_cast<Index>(s.shape[0]) : 1,
              static_cast<Index>(s.shape[s.shape.size() - 2]));
    v.values = s.values;
    return v;
  }
  Rows rows(const std::string& name) const {
    const Stage& s = recorded(name);
    Rows result(s.shape[0]);
    for (std::size_t i = 0; i < result.size(); ++i) {
      const auto begin = s.values.begin() + static_cast<std::ptrdiff_t>(i * s.shape[1]);
      result[i].assign(begin, begin + static_cast<std::ptrdiff_t>(s.shape[1]));
    }
    return result;
  }

  void check_edges() {
    const Stage& points = recorded("points");
    const auto count = static_cast<Index>(points.shape[0]);
    std::vector<float> axes[3];
    for (std::size_t i = 0; i < points.values.size(); ++i) {
      axes[i % 3].push_back(static_cast<float>(points.values[i]));
    }
    const kernels::Coordinates xyz{axes[0].data(), axes[1].data(), axes[2].data()};
    Vectors edges(count, 3);
    const auto k = static_cast<double>(w_.neighbours);
    for (Index i = 0; i < count; ++i) {
      const auto order = reference::by_distance(xyz, count, i);
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (std::uint64_t n = 0; n < w_.neighbours; ++n) {
        for (Index axis = 0; axis < 3; ++axis) {
          mean(axis) += static_cast<double>(axes[axis][static_cast<std::size_t>(order[n])]) / k;
        }
      }
      const Eigen::Vector3d x(points.values.data() + 3 * i);
      const Eigen::Vector3d parts[3] = {mean - x, x, mean.cross(x)};
      for (Index e = 0; e < 3; ++e) {
        for (Index axis = 0; axis < 3; ++axis) edges.at(i, e, axis) = parts[e](axis);
      }
    }
    REQUIRE(error(recorded("edge"), edges.values) < 1e-6);
  }

  void check_block(const std::string& stage_name, const std::string& tensors,
                   const Vectors& input) {
    CAPTURE(side_, stage_name);
    REQUIRE(error(recorded(stage_name), reference::vn_block(block(tensors), input).values) < 2e-5);
  }
  Vectors with_mean(const std::string& name) const {
    const Vectors v = vectors(name);
    return reference::concatenate(v, reference::mean(v));
  }

  void check_encoder() {
    const auto c = static_cast<Index>(w_.global);
    check_block("network0.block0", "encoder.network0.0",
                reference::vn_linear(tensor("encoder.pre"), 2 * c, vectors("edge")));
    check_block("network0.block1", "encoder.network0.1", with_mean("network0.block0"));
    check_block("network0.block2", "encoder.network0.2", with_mean("network0.block1"));
    check_block("network1.block0", "encoder.network1.0", with_mean("network0.block2"));
    const Vectors last =
        reference::vn_block(block("encoder.network1.1"), with_mean("network1.block0"));
    const Vectors pooled = reference::vn_relu(tensor("encoder.global.relu"), w_.shared_direction,
                                              reference::mean(last));
    const Vectors global = reference::vn_linear(tensor("encoder.global.fc"), c, pooled);
    // A mean over points of vectors that cancel: the norm is small beside the terms. Compilers
    // differ in how they round them: 1e-4 with GCC, 3e-4 with clang.
    REQUIRE(error(recorded("global"), global.values) < 5e-4);
  }

  void check_local_module() {
    check_block("network2.block0", "local.network2.0",
                reference::concatenate(vectors("network0.block2"), vectors("global")));
    check_block("network2.block1", "local.network2.1", with_mean("network2.block0"));
    Vectors z = vectors("network2.block1");
    for (int i = 0; i < 2; ++i) {
      const std::string name = "local.invariant." + std::to_string(i);
      z = reference::vn_norm_layer(tensor(name + ".fc"), tensor(name + ".direction"),
                                   tensor(name + ".scale"), tensor(name + ".shift"),
                                   w_.shared_direction, z);
    }
    z = reference::vn_linear(tensor("local.invariant.2.fc"), 3, z);
    REQUIRE(error(recorded("frame"), z.values) < 2e-4);
    Rows descriptors = reference::invariant_products(vectors("network2.block1"), vectors("frame"));
    for (Row& row : descriptors) {
      row = reference::relu(reference::linear(tensor("local.descriptor.weight"),
                                              tensor("local.descriptor.bias"), row));
    }
    REQUIRE(error(recorded("descriptor"), flatten(descriptors)) < 1e-5);
  }

  Row mlp(const std::string& name, int layers, Row x) const {
    for (int i = 0; i < layers; ++i) {
      const std::string layer = name + "." + std::to_string(i);
      x = reference::linear(tensor(layer + ".weight"), tensor(layer + ".bias"), x);
      if (i + 1 < layers) x = reference::relu(std::move(x));
    }
    return x;
  }

  void check_significance() {
    std::vector<double> expected;
    for (const Row& row : rows("descriptor")) {
      expected.push_back(mlp("fine.significance", 3, row)[0]);
    }
    REQUIRE(error(recorded("significance"), expected) < 1e-5);

    const std::vector<double>& significance = recorded("significance").values;
    std::vector<double> order(significance.size());
    std::iota(order.begin(), order.end(), 0.0);
    std::stable_sort(order.begin(), order.end(), [&](double a, double b) {
      return significance[static_cast<std::size_t>(a)] > significance[static_cast<std::size_t>(b)];
    });
    order.resize(significance.size() / w_.keep_divisor);
    REQUIRE(recorded("kept").values == order);
  }

  struct Procrustes {
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    double gap = 0;  // how well the rotation is determined, relative to the spread of x
  };

  /// Weighted Procrustes by its definition.
  static Procrustes procrustes(const std::vector<Eigen::Vector3d>& x,
                               const std::vector<Eigen::Vector3d>& y, const Row& weights) {
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    Eigen::Vector3d mean_x = Eigen::Vector3d::Zero();
    Eigen::Vector3d mean_y = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < x.size(); ++i) {
      mean_x += weights[i] / total * x[i];
      mean_y += weights[i] / total * y[i];
    }
    Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
    double spread = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      spread += weights[i] * (x[i] - mean_x).squaredNorm();
      h += weights[i] * (y[i] - mean_y) * (x[i] - mean_x).transpose();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(h, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d d = Eigen::Matrix3d::Identity();
    d(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    Procrustes result;
    result.motion.linear() = svd.matrixU() * d * svd.matrixV().transpose();
    result.motion.translation() = mean_y - result.motion.linear() * mean_x;
    const Eigen::Vector3d& sigma = svd.singularValues();
    result.gap = (sigma(1) + d(2, 2) * sigma(2)) / spread;
    return result;
  }

  static double cost(const Eigen::Isometry3d& motion, const std::vector<Eigen::Vector3d>& x,
                     const std::vector<Eigen::Vector3d>& y, const Row& weights) {
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      sum += weights[i] * (motion * x[i] - y[i]).squaredNorm();
    }
    return sum;
  }

  static std::vector<Eigen::Vector3d> points_of(const std::vector<double>& values) {
    std::vector<Eigen::Vector3d> points(values.size() / 3);
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = Eigen::Vector3d(&values[3 * i]);
    return points;
  }

  void check_coarse() {
    const auto x = points_of(stage(registrar_, "source.global").values);
    const auto y = points_of(stage(registrar_, "target.global").values);
    const Procrustes expected = procrustes(x, y, Row(x.size(), 1.0));
    REQUIRE(expected.gap > 1e-6);
    check_pose("coarse.T", expected.motion);
  }

  void check_pose(const std::string& name, const Eigen::Isometry3d& expected) {
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = expected.matrix();
    CAPTURE(name);
    REQUIRE(error(stage(registrar_, name), {matrix.data(), matrix.data() + 16}) < 1e-5);
  }

  static Eigen::Isometry3d pose_of(const Stage& s) {
    Pose pose;
    std::copy(s.values.begin(), s.values.end(), pose.begin());
    return motion_of(pose);
  }

  struct Kept {
    std::vector<Eigen::Vector3d> points;
    Rows descriptors;
  };
  Kept kept(const std::string& side) {
    side_ = side;
    const auto points = points_of(recorded("points").values);
    const Rows descriptors = rows("descriptor");
    Kept result;
    for (const double index : recorded("kept").values) {
      result.points.push_back(points[static_cast<std::size_t>(index)]);
      result.descriptors.push_back(descriptors[static_cast<std::size_t>(index)]);
    }
    side_.clear();
    return result;
  }

  void check_fine_iteration(std::uint64_t iteration) {
    const std::string prefix = "fine." + std::to_string(iteration) + ".";
    const std::string before =
        iteration == 0 ? "coarse.T" : "fine." + std::to_string(iteration - 1) + ".T";
    const Eigen::Isometry3d pose = pose_of(stage(registrar_, before));
    Kept source = kept("source");
    const Kept target = kept("target");
    for (Eigen::Vector3d& p : source.points) p = pose * p;

    const auto pair = static_cast<Index>(w_.pair);
    const kernels::PairTensors t{
        static_cast<Index>(w_.descriptor),  pair,
        tensor("fine.pair.0.weight"),       tensor("fine.pair.0.bias"),
        tensor("fine.pair.1.weight"),       tensor("fine.pair.1.bias"),
        tensor("fine.similarity.0.weight"), tensor("fine.similarity.0.bias"),
        tensor("fine.similarity.1.weight"), tensor("fine.similarity.1.bias")};
    std::vector<double> similarities;
    Row weights;
    for (std::size_t i = 0; i < source.points.size(); ++i) {
      Row maximum(w_.pair, -std::numeric_limits<double>::infinity());
      for (std::size_t j = 0; j < target.points.size(); ++j) {
        const Row f =
            reference::pair_feature(t, source.descriptors[i], target.descriptors[j],
                                    {source.points[i].data(), 3}, {target.points[j].data(), 3});
        similarities.push_back(reference::similarity(t, f));
        for (std::size_t c = 0; c < f.size(); ++c) maximum[c] = std::max(maximum[c], f[c]);
      }
      weights.push_back(1 / (1 + std::exp(-mlp("fine.weight", 2, maximum)[0])));
    }
    REQUIRE(error(stage(registrar_, prefix + "similarity"), similarities) < 5e-5);
    check_match(prefix, target.points.size());
    check_weights(prefix, weights);
    check_step(prefix, pose, source.points, target.points);
  }

  void check_match(const std::string& prefix, std::size_t targets) {
    const std::vector<double>& similarity = stage(registrar_, prefix + "similarity").values;
    const std::vector<double>& match = stage(registrar_, prefix + "match").values;
    REQUIRE(match.size() * targets == similarity.size());
    for (std::size_t i = 0; i < match.size(); ++i) {
      const auto row = similarity.begin() + static_cast<std::ptrdiff_t>(i * targets);
      const auto best = std::max_element(row, row + static_cast<std::ptrdiff_t>(targets));
      REQUIRE(match[i] == static_cast<double>(best - row));
    }
  }

  /// Weights at the median may fall on either side of it by rounding: they are left out.
  void check_weights(const std::string& prefix, const Row& raw) {
    Row sorted = raw;
    std::sort(sorted.begin(), sorted.end());
    const double median = sorted[(sorted.size() - 1) / 2];
    const std::vector<double>& got = stage(registrar_, prefix + "weight").values;
    REQUIRE(got.size() == raw.size());
    const double kept_sum = std::accumulate(
        raw.begin(), raw.end(), 0.0, [&](double s, double v) { return v < median ? s : s + v; });
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (std::abs(raw[i] - median) < 1e-5 * median) continue;
      const double expected = raw[i] < median ? 0.0 : raw[i] / (kept_sum + 1e-8);
      REQUIRE(got[i] == Approx(expected).epsilon(1e-3));
    }
    REQUIRE(std::accumulate(got.begin(), got.end(), 0.0) == Approx(1).epsilon(1e-5));
    const auto zeros = static_cast<std::size_t>(std::count(got.begin(), got.end(), 0.0));
    REQUIRE(zeros <= (got.size() - 1) / 2);
  }

  void check_step(const std::string& prefix, const Eigen::Isometry3d& before,
                  const std::vector<Eigen::Vector3d>& source,
                  const std::vector<Eigen::Vector3d>& target) {
    std::vector<Eigen::Vector3d> matched;
    for (const double j : stage(registrar_, prefix + "match").values) {
      matched.push_back(target[static_cast<std::size_t>(j)]);
    }
    const std::vector<double>& weights = stage(registrar_, prefix + "weight").values;
    const Procrustes step = procrustes(source, matched, weights);
    const Eigen::Isometry3d got = pose_of(stage(registrar_, prefix + "T"));
    REQUIRE((got.linear() * got.linear().transpose()).isIdentity(1e-9));
    REQUIRE(got.linear().determinant() == Approx(1));
    REQUIRE(cost(got * before.inverse(), source, matched, weights) <=
            cost(step.motion, source, matched, weights) * (1 + 1e-5) + 1e-9);
    // A random network may match all points to few: then only the cost is determined.
    if (step.gap > 1e-3) check_pose(prefix + "T", step.motion * before);
  }

  const ModelDraft& draft_;
  const Registrar& registrar_;
  Widths w_;
  std::string side_;
};

struct Case {
  const char* what;
  Widths widths;
  std::size_t source, target;
};

const Case cases[] = {
    {"usual", {}, 333, 300},
    {"odd widths, k = 1",
     {.global = 5,
      .local = 4,
      .descriptor = 7,
      .pair = 3,
      .significance = {5, 3},
      .neighbours = 1,
      .keep_divisor = 4},
     65,
     64},
    {"small", {.global = 8, .local = 8, .descriptor = 9, .pair = 5}, 36, 37},
    {"small, shared direction",
     {.global = 8, .local = 8, .descriptor = 9, .pair = 5, .shared_direction = true},
     63,
     100},
    {"identity shortcut", {.global = 32, .local = 64}, 129, 128},
    {"identity shortcut, shared direction, odd halves",
     {.global = 6, .local = 12, .shared_direction = true},
     97,
     96},
    {"local wider than twice global", {.global = 4, .local = 20}, 96, 333},
    {"47 channels", {.global = 47, .local = 48, .neighbours = 64}, 65, 127},
    {"coordinates as given, one iteration",
     {.global = 9, .fine_iterations = 1, .keep_divisor = 1, .rms_radius = 0},
     40,
     33},
};

TEST_CASE("every stage equals the formulas of the design") {
  for (const Case& c : cases) {
    SECTION(c.what) {
      const ModelDraft draft = random_model(c.widths, 5);
      Random random(6);
      const Points source = shape(c.source, random);
      const Points target = moved(shape(c.target, random), random_motion(random, 3));
      Registrar registrar(draft.build(),
                          {.mode = Mode::paper, .threads = 1, .record_stages = true});
      const Result& result = registrar.align(source, target);
      REQUIRE(result.status == Status::ok);
      NaiveNetwork naive(draft, registrar, c.widths);
      naive.check_cloud("source");
      naive.check_cloud("target");
      naive.check_pair();
    }
  }
}

TEST_CASE("network coordinates and the way back to the user's units") {
  const ModelDraft draft = random_model({.rms_radius = 0.4});
  Random random(7);
  const Points source = moved(shape(100, random), random_motion(random, 1), 30);
  const Points target = moved(shape(90, random), random_motion(random, 1), 20);
  Registrar registrar(draft.build(), {.mode = Mode::paper, .record_stages = true});
  const Result& result = registrar.align(source, target);
  REQUIRE(result.has_pose);
  Eigen::Vector3d centroids[2];
  double radius[2];
  const Points* clouds[2] = {&source, &target};
  for (int side = 0; side < 2; ++side) {
    centroids[side].setZero();
    for (const auto& p : *clouds[side]) centroids[side] += Eigen::Vector3d(p.data());
    centroids[side] /= static_cast<double>(clouds[side]->size());
    radius[side] = 0;
    for (const auto& p : *clouds[side]) {
      radius[side] += (Eigen::Vector3d(p.data()) - centroids[side]).squaredNorm();
    }
    radius[side] = std::sqrt(radius[side] / static_cast<double>(clouds[side]->size()));
  }
  const double scale = std::max(radius[0], radius[1]) / 0.4;
  const char* names[2] = {"source.points", "target.points"};
  for (int side = 0; side < 2; ++side) {
    std::vector<double> expected;
    for (const auto& p : *clouds[side]) {
      for (int axis = 0; axis < 3; ++axis) {
        expected.push_back((p[static_cast<std::size_t>(axis)] - centroids[side](axis)) / scale);
      }
    }
    REQUIRE(error(stage(registrar, names[side]), expected) < 1e-7);
  }
  Pose network;
  const Stage& last = stage(registrar, "fine.2.T");
  std::copy(last.values.begin(), last.values.end(), network.begin());
  const Eigen::Isometry3d pose = motion_of(network);
  Eigen::Isometry3d expected = pose;
  expected.translation() = centroids[1] + scale * pose.translation() - pose.linear() * centroids[0];
  REQUIRE((motion_of(result.T_target_source).matrix() - expected.matrix()).norm() < 1e-9);
}

TEST_CASE("stages are recorded only on request, in the documented order and shape") {
  Random random(8);
  const Points cloud = shape(70, random);
  Registrar silent(random_model().build(), {.mode = Mode::paper});
  silent.align(cloud, cloud);
  REQUIRE(silent.stages().empty());

  Registrar registrar(random_model().build(), {.mode = Mode::paper, .record_stages = true});
  registrar.align(cloud, cloud);
  const auto count = registrar.stages().size();
  std::map<std::string, std::vector<std::size_t>> shapes;
  for (const Stage& s : registrar.stages()) shapes[s.name] = s.shape;
  REQUIRE(shapes.size() == count);
  using Shape = std::vector<std::size_t>;
  REQUIRE(shapes.at("source.points") == Shape{70, 3});
  REQUIRE(shapes.at("source.edge") == Shape{70, 3, 3});
  REQUIRE(shapes.at("target.network0.block2") == Shape{70, 16, 3});
  REQUIRE(shapes.at("target.global") == Shape{16, 3});
  REQUIRE(shapes.at("source.network2.block0") == Shape{70, 16, 3});
  REQUIRE(shapes.at("source.frame") == Shape{70, 3, 3});
  REQUIRE(shapes.at("source.descriptor") == Shape{70, 16});
  REQUIRE(shapes.at("source.significance") == Shape{70});
  REQUIRE(shapes.at("target.kept") == Shape{11});
  REQUIRE(shapes.at("coarse.T") == Shape{4, 4});
  REQUIRE(shapes.at("fine.1.similarity") == Shape{11, 11});
  REQUIRE(shapes.at("fine.2.T") == Shape{4, 4});
  REQUIRE(count == 2 * 13 + 1 + 3 * 4);
  REQUIRE(registrar.stages().front().name == "source.points");
  REQUIRE(registrar.stages().back().name == "fine.2.T");
  registrar.align(cloud, cloud);
  REQUIRE(registrar.stages().size() == count);

  Registrar coarse(random_model().build(), {.mode = Mode::coarse, .record_stages = true});
  coarse.align(cloud, cloud);
  REQUIRE(coarse.stages().back().name == "coarse.T");
  REQUIRE(coarse.stages().size() == 2 * 7 + 1);
}

}  // namespace
}  // namespace vnreg::test
