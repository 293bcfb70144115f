#include "no_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "command.hpp"

namespace vnreg::cli {
namespace {

using Fault = std::optional<std::string>;

/// The engine refuses coordinates beyond this, too: their squares overflow.
constexpr double largest_coordinate = 1e300;

bool is_usable(const std::array<double, 3>& point) {
  return std::ranges::all_of(point,
                             [](double value) { return std::abs(value) <= largest_coordinate; });
}

Fault not_finite(const NamedCloud& cloud) {
  const auto bad = std::ranges::find_if_not(cloud.points, is_usable);
  if (bad == cloud.points.end()) return std::nullopt;
  const auto& [x, y, z] = *bad;
  return "point " + std::to_string(bad - cloud.points.begin() + 1) +
         ": expected finite coordinates, found " + number_text(x, 6) + " " + number_text(y, 6) +
         " " + number_text(z, 6);
}

Fault too_few(const NamedCloud& cloud, int min_points) {
  if (cloud.points.size() >= static_cast<std::size_t>(min_points)) return std::nullopt;
  return "expected at least " + std::to_string(min_points) + " points, found " +
         std::to_string(cloud.points.size());
}

Fault all_equal(const NamedCloud& cloud) {
  const auto& points = cloud.points;
  if (std::ranges::adjacent_find(points, std::ranges::not_equal_to{}) != points.end()) {
    return std::nullopt;
  }
  return "expected points that differ, found " + std::to_string(points.size()) + " equal points";
}

Fault fault_of(const NamedCloud& cloud, Status status, int min_points) {
  if (status == Status::too_few_points) return too_few(cloud, min_points);
  if (status == Status::not_finite) return not_finite(cloud);
  if (status == Status::degenerate) return all_equal(cloud);
  return std::nullopt;
}

}  // namespace

std::string why_no_pose(const Result& result, const NamedCloud& source, const NamedCloud& target,
                        int min_points) {
  for (const NamedCloud& cloud : {source, target}) {
    const Fault fault = fault_of(cloud, result.status, min_points);
    if (fault) return cloud.path + ": " + *fault;
  }
  const std::string both = source.path + " and " + target.path + ": expected ";
  if (result.status == Status::timed_out) {
    return both + "a pose within the time budget, found none in " +
           number_text(result.ms.total, 3) + " ms";
  }
  return both + "clouds that determine a rotation, found status " +
         std::string(to_string(result.status));
}

}  // namespace vnreg::cli
