#include "engine/architecture.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>

namespace vnreg::detail {
namespace {

using model_format::ModelFile;

constexpr std::uint64_t max_channels = 512;

Index read_index(const ModelFile& file, std::string_view key, std::uint64_t min,
                 std::uint64_t max) {
  return static_cast<Index>(file.get_u64(key, min, max));
}

[[noreturn]] void refuse(std::string_view key, std::string expected, std::string got) {
  throw Error(ErrorCode::wrong_architecture, "metadata \"" + std::string(key) + "\"",
              std::move(expected), std::move(got));
}

std::string read_name(const ModelFile& file) {
  std::string name = file.get_string("name");
  if (name.empty() || name.size() > 64) {
    refuse("name", "1 to 64 bytes", std::to_string(name.size()));
  }
  return name;
}

/// Free text, but text, and of bounded length.
void check_provenance(const ModelFile& file) {
  for (const auto& [key, value] : file.metadata()) {
    if (!key.starts_with("provenance.")) continue;
    if (const std::size_t size = file.get_string(key).size(); size > 4096) {
      refuse(key, "up to 4096 bytes", std::to_string(size));
    }
  }
}

/// Moments have radii in network coordinates, so architecture `vnreg` has no use for coordinates as
/// they are given.
double read_rms_radius(const ModelFile& file, Family family) {
  if (family == Family::vnreg) return file.get_f64("input.rms_radius", 1e-3, 1e3);
  const double radius = file.get_f64("input.rms_radius", 0.0, 1e3);
  if (radius != 0.0 && radius < 1e-3) {
    refuse("input.rms_radius", "0 or 1e-3 to 1e3", std::to_string(radius));
  }
  return radius;
}

/// A switch that files before it do not have: true then.
bool unless_false(const ModelFile& file, std::string_view key) {
  return !file.has(key) || file.get_bool(key);
}

void read_paper_parameters(const ModelFile& file, Architecture& a) {
  a.channels_local = read_index(file, "channels.local", 4, max_channels);
  if (a.channels_local % 4 != 0) {
    refuse("channels.local", "a multiple of 4", std::to_string(a.channels_local));
  }
  a.channels_descriptor = read_index(file, "channels.descriptor", 1, max_channels);
  a.channels_pair = read_index(file, "channels.pair", 1, max_channels);
  a.channels_significance[0] = read_index(file, "channels.significance.0", 1, max_channels);
  a.channels_significance[1] = read_index(file, "channels.significance.1", 1, max_channels);
  a.neighbours = read_index(file, "neighbours", 1, 64);
  a.shared_direction = file.get_bool("relu.shared_direction");
  a.shared_encoder = unless_false(file, "ablation.shared_encoder");
  a.invariant_layer = unless_false(file, "ablation.invariant_layer");
  a.fine_iterations = read_index(file, "fine.iterations", 0, 16);
  a.keep_divisor = read_index(file, "fine.keep_divisor", 1, 64);
}

bool has_any(const ModelFile& file, std::span<const std::string> keys) {
  return std::any_of(keys.begin(), keys.end(), [&](const auto& key) { return file.has(key); });
}

double read_finite(const ModelFile& file, std::string_view key) {
  constexpr double limit = std::numeric_limits<double>::max();
  return file.get_f64(key, -limit, limit);
}

}  // namespace

Index Architecture::min_points() const noexcept {
  return std::max({neighbours, 3 * keep_divisor, Index{24}});
}

Architecture read_architecture(const ModelFile& file) {
  Architecture a;
  const std::string arch = file.get_string("arch");
  if (arch != "paper" && arch != "vnreg") {
    refuse("arch", "paper or vnreg", arch == "golden" ? arch : "another");
  }
  a.family = arch == "paper" ? Family::paper : Family::vnreg;
  a.name = read_name(file);
  check_provenance(file);
  a.channels_global = read_index(file, "channels.global", 4, max_channels);
  if (a.family == Family::paper) {
    read_paper_parameters(file, a);
  } else {
    a.neighbours = 2;
  }
  a.rms_radius = read_rms_radius(file, a.family);
  a.points = read_index(file, "input.points",
                        static_cast<std::uint64_t>(std::max(Index{64}, a.min_points())), 16384);
  return a;
}

std::optional<Calibration> read_calibration(const ModelFile& file) {
  const std::array<std::string, 3> keys{"calibration.bias", "calibration.overlap",
                                        "calibration.residual"};
  if (!has_any(file, keys)) return std::nullopt;
  return Calibration{read_finite(file, keys[0]), read_finite(file, keys[1]),
                     read_finite(file, keys[2])};
}

std::optional<VerifiedCalibration> read_verified_calibration(const ModelFile& file) {
  constexpr std::size_t weights = Evidence::names.size();
  const std::string prefix = "calibration.verified.";
  std::array<std::string, weights + 1> keys;
  std::transform(Evidence::names.begin(), Evidence::names.end(), keys.begin(),
                 [&](std::string_view name) { return prefix + std::string(name); });
  keys[weights] = prefix + "bias";
  if (!has_any(file, keys)) return std::nullopt;
  VerifiedCalibration calibration;
  for (std::size_t i = 0; i < weights; ++i) calibration.weights[i] = read_finite(file, keys[i]);
  calibration.bias = read_finite(file, keys[weights]);
  return calibration;
}

double read_covariance_inflation(const ModelFile& file) {
  constexpr std::string_view key = "calibration.verified.covariance";
  return file.has(key) ? file.get_f64(key, 1e-3, 1e3) : 1.0;
}

}  // namespace vnreg::detail
