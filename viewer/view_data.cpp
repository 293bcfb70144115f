#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/json_text.hpp"
#include "viewer/shown_cloud.hpp"
#include "viewer/view.hpp"

namespace vnreg::viewer {
namespace {

template <class T>
std::string array_json(const std::vector<T>& values) {
  return json_bytes(std::as_bytes(std::span(values)));
}

std::string cloud_json(std::string_view name, const ShownCloud& cloud) {
  return JsonObject()
      .add("name", json_string(name))
      .add("given", std::to_string(cloud.given))
      .add("unusable", std::to_string(cloud.unusable))
      .add("shown", std::to_string(cloud.points.size()))
      .add("origin", json_numbers(cloud.origin))
      .add("xyz", array_json(cloud.points))
      .text();
}

std::string alternative_json(const Alternative& pose) {
  return JsonObject()
      .add("pose", json_numbers(pose.T_target_source))
      .add("score", json_number(pose.score))
      .text();
}

template <class Poses>
std::string poses_json(const Poses& poses) {
  JsonArray list;
  for (const Alternative& pose : poses) list.add(alternative_json(pose));
  return list.text();
}

std::string times_json(const StageTimes& ms) {
  return JsonObject()
      .add("prepare", json_number(ms.prepare))
      .add("encode", json_number(ms.encode))
      .add("coarse", json_number(ms.coarse))
      .add("fine", json_number(ms.fine))
      .add("hypotheses", json_number(ms.hypotheses))
      .add("verify", json_number(ms.verify))
      .add("measure", json_number(ms.measure))
      .add("total", json_number(ms.total))
      .text();
}

std::string evidence_json(const Evidence& evidence) {
  if (std::isnan(evidence.score)) return "null";
  const auto values = evidence.values();
  JsonObject object;
  for (std::size_t i = 0; i < values.size(); ++i) {
    object.add(Evidence::names[i], json_number(values[i]));
  }
  return object.text();
}

/// R.m.s. error of the rotation in degrees, if the pose is right.
double rotation_error_deg(const Covariance& c) {
  constexpr double degrees = 57.29577951308232;
  return degrees * std::sqrt(c[0] + c[7] + c[14]);
}

std::string result_json(const Result& result) {
  return JsonObject()
      .add("status", json_string(to_string(result.status)))
      .add("pose", result.has_pose ? json_numbers(result.T_target_source) : "null")
      .add("coarse_pose", result.has_pose ? json_numbers(result.T_target_source_coarse) : "null")
      .add("confidence", json_number(result.confidence))
      .add("score", json_number(result.score))
      .add("overlap", json_number(result.overlap))
      .add("rmse", json_number(result.rmse))
      .add("inlier_distance", json_number(result.inlier_distance))
      .add("rotation_error_deg", json_number(rotation_error_deg(result.covariance)))
      .add("alternatives", poses_json(result.alternatives))
      .add("evidence", evidence_json(result.evidence))
      .add("points_source", std::to_string(result.points_source))
      .add("points_target", std::to_string(result.points_target))
      .add("ms", times_json(result.ms))
      .text();
}

/// Places less the shown cloud's origin, and significances.
std::string described_json(const std::vector<Explanation::Point>& points,
                           const std::array<double, 3>& origin) {
  std::vector<std::array<float, 3>> places;
  std::vector<float> significances;
  for (const Explanation::Point& point : points) {
    places.push_back(relative_to(origin, point.position));
    significances.push_back(static_cast<float>(point.significance));
  }
  return JsonObject()
      .add("xyz", array_json(places))
      .add("significance", array_json(significances))
      .text();
}

std::string matches_json(const std::vector<Explanation::Match>& matches) {
  std::vector<std::uint32_t> ends;
  std::vector<float> weights;
  for (const Explanation::Match& match : matches) {
    ends.push_back(match.source);
    ends.push_back(match.target);
    weights.push_back(static_cast<float>(match.weight));
  }
  return JsonObject().add("ends", array_json(ends)).add("weight", array_json(weights)).text();
}

std::string explanation_json(const Explanation* explanation, const ShownCloud& source,
                             const ShownCloud& target) {
  if (explanation == nullptr) return "null";
  return JsonObject()
      .add("source", described_json(explanation->source, source.origin))
      .add("target", described_json(explanation->target, target.origin))
      .add("matches", matches_json(explanation->matches))
      .add("hypotheses", poses_json(explanation->hypotheses))
      .text();
}

}  // namespace

std::string view_data(const ViewedPair& pair) {
  const ShownCloud source = choose_shown(pair.source);
  const ShownCloud target = choose_shown(pair.target);
  return JsonObject()
      .add("format", "1")
      .add("version", json_string(version()))
      .add("model", json_string(pair.model))
      .add("mode", json_string(pair.mode))
      .add("source", cloud_json(pair.source_name, source))
      .add("target", cloud_json(pair.target_name, target))
      .add("result", result_json(pair.result))
      .add("explanation", explanation_json(pair.explanation, source, target))
      .text();
}

}  // namespace vnreg::viewer
