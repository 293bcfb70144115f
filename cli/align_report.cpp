#include "align_report.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <locale>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <utility>
#include <vector>

#include "command.hpp"
#include "rotation.hpp"
#include "terminal.hpp"

namespace vnreg::cli {
namespace {

using Json = nlohmann::ordered_json;

struct NamedTime {
  const char* name;
  double ms;
};

std::array<NamedTime, 8> named_times(const StageTimes& ms) {
  return {{{"prepare", ms.prepare},
           {"encode", ms.encode},
           {"coarse", ms.coarse},
           {"fine", ms.fine},
           {"hypotheses", ms.hypotheses},
           {"verify", ms.verify},
           {"measure", ms.measure},
           {"total", ms.total}}};
}

std::string vector_text(const std::array<double, 3>& vector, int digits) {
  std::string text = "(";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axis > 0) text += ", ";
    text += number_text(vector[axis], digits);
  }
  return text + ")";
}

std::string pose_text(const Pose& pose) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      text << "  " << std::setw(16) << std::setprecision(10) << pose[4 * row + column];
    }
    text << '\n';
  }
  return text.str();
}

/// R.m.s. error of the rotation, in degrees, and of where the pose puts the middle of the source.
std::string uncertainty_text(const AlignReport& report) {
  const Covariance& covariance = report.result.covariance;
  const auto [x, y, z] = transform(report.result.T_target_source, report.source_middle);
  // An error (w, v) moves the point c by v + w cross c.
  const double moves[3][6] = {{0, z, -y, 1, 0, 0}, {-z, 0, x, 0, 1, 0}, {y, -x, 0, 0, 0, 1}};
  double turn = 0;
  double shift = 0;
  for (std::size_t a = 0; a < 6; ++a) {
    if (a < 3) turn += covariance[7 * a];
    for (std::size_t b = 0; b < 6; ++b) {
      for (const auto& move : moves) shift += move[a] * covariance[6 * a + b] * move[b];
    }
  }
  return number_text(std::sqrt(turn) * 180 / std::numbers::pi, 2) + " degrees, " +
         number_text(std::sqrt(std::max(shift, 0.0)), 2) +
         " at the middle of the source (r.m.s., if the pose is right)";
}

std::string alternative_text(const Alternative& other, const AlignReport& report) {
  const Pose& pose = report.result.T_target_source;
  const auto [x0, y0, z0] = transform(pose, report.source_middle);
  const auto [x1, y1, z1] = transform(other.T_target_source, report.source_middle);
  return "score " + number_text(other.score, 3) + ", " +
         number_text(rotation_difference_deg(pose, other.T_target_source), 4) + " degrees and " +
         number_text(std::hypot(x1 - x0, y1 - y0, z1 - z0), 3) + " from this pose";
}

Json pose_json(const Result& result, const Pose& pose) {
  if (!result.has_pose) return nullptr;
  Json rows = Json::array();
  for (std::size_t row = 0; row < 4; ++row) {
    rows.push_back({pose[4 * row], pose[4 * row + 1], pose[4 * row + 2], pose[4 * row + 3]});
  }
  return rows;
}

Json covariance_json(const Covariance& covariance) {
  if (std::isnan(covariance[0])) return nullptr;
  Json rows = Json::array();
  for (std::size_t row = 0; row < 6; ++row) {
    const auto begin = covariance.begin() + static_cast<std::ptrdiff_t>(6 * row);
    rows.push_back(std::vector<double>(begin, begin + 6));
  }
  return rows;
}

Json evidence_json(const Evidence& evidence) {
  if (std::isnan(evidence.score)) return nullptr;
  Json json;
  const auto values = evidence.values();
  for (std::size_t i = 0; i < values.size(); ++i) json[std::string(evidence.names[i])] = values[i];
  return json;
}

Json alternatives_json(const Result& result) {
  Json list = Json::array();
  for (const Alternative& alternative : result.alternatives) {
    Json item;
    item["T_target_source"] = pose_json(result, alternative.T_target_source);
    item["score"] = alternative.score;
    list.push_back(std::move(item));
  }
  return list;
}

}  // namespace

std::string to_text(const AlignReport& report) {
  const Result& result = report.result;
  const Pose& pose = result.T_target_source;
  const AxisAngle rotation = axis_angle(pose);
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "T_target_source\n" << pose_text(pose);
  text << "rotation     " << number_text(rotation.angle_deg, 6) << " degrees about "
       << vector_text(rotation.axis, 6) << '\n';
  text << "translation  " << vector_text({pose[3], pose[7], pose[11]}, 8) << '\n';
  if (!std::isnan(result.covariance[0]))
    text << "uncertainty  " << uncertainty_text(report) << '\n';
  const bool trusted = result.status == Status::ok;
  text << "status       "
       << coloured(to_string(result.status), trusted ? Colour::green : Colour::yellow,
                   STDOUT_FILENO)
       << '\n';
  text << "confidence   "
       << (std::isnan(result.confidence) ? "n/a" : number_text(result.confidence, 3)) << '\n';
  if (!std::isnan(result.score)) text << "score        " << number_text(result.score, 3) << '\n';
  for (const Alternative& other : result.alternatives) {
    text << "alternative  " << alternative_text(other, report) << '\n';
  }
  text << "overlap      " << number_text(result.overlap, 3) << '\n';
  text << "rmse         " << number_text(result.rmse, 4) << " (of points closer than "
       << number_text(result.inlier_distance, 4) << ")\n";
  text << "points       " << result.points_source << " source, " << result.points_target
       << " target\n";
  if (const std::size_t dropped = result.dropped_source + result.dropped_target; dropped > 0) {
    text << "dropped      " << result.dropped_source << " source, " << result.dropped_target
         << " target (not finite)\n";
  }
  text << "model        " << report.model << ", mode " << to_string(report.mode) << '\n';
  text << "time        ";
  for (const NamedTime& time : named_times(result.ms)) {
    text << ' ' << time.name << ' ' << number_text(time.ms, 3);
  }
  text << " ms\n";
  return text.str();
}

std::string to_json(const AlignReport& report) {
  const Result& result = report.result;
  Json ms;
  for (const NamedTime& time : named_times(result.ms)) ms[time.name] = time.ms;
  Json json;
  json["status"] = to_string(result.status);
  json["T_target_source"] = pose_json(result, result.T_target_source);
  json["T_target_source_coarse"] = pose_json(result, result.T_target_source_coarse);
  json["covariance"] = covariance_json(result.covariance);
  json["confidence"] = result.confidence;  // the library writes NaN as null
  json["overlap"] = result.overlap;
  json["rmse"] = result.rmse;
  json["score"] = result.score;
  json["inlier_distance"] = result.inlier_distance;
  json["alternatives"] = alternatives_json(result);
  json["evidence"] = evidence_json(result.evidence);
  json["points_source"] = result.points_source;
  json["points_target"] = result.points_target;
  json["dropped_source"] = result.dropped_source;
  json["dropped_target"] = result.dropped_target;
  json["ms"] = std::move(ms);
  json["model"] = report.model;
  json["mode"] = to_string(report.mode);
  return json.dump(2) + "\n";
}

}  // namespace vnreg::cli
