#include "align_many.hpp"

#include <unistd.h>

#include <iomanip>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "align_report.hpp"
#include "input.hpp"
#include "no_pose.hpp"
#include "progress_bar.hpp"
#include "rotation.hpp"
#include "shown_text.hpp"
#include "terminal.hpp"

namespace vnreg::cli {
namespace {

using cloud_file::Points;
using Json = nlohmann::ordered_json;

/// What became of one source.
struct Row {
  std::string source;
  std::optional<Result> result;  // nothing: the file cannot be read
  std::string error;             // empty where there is a pose
};

class ManyAligner {
 public:
  ManyAligner(const AlignArguments& arguments, const std::string& target)
      : arguments_(arguments),
        target_name_(input_name(target)),
        target_(read_input_cloud(target, arguments.format)),
        model_(arguments.engine.load()),
        registrar_(make_registrar(model_, arguments.engine.options)) {}

  Row align(const std::string& source) {
    Row row{source, std::nullopt, ""};
    try {
      const Points points = cloud_file::read_cloud(source);
      row.result = registrar_.align(points, target_);
      if (!row.result->has_pose) {
        row.error = why_no_pose(*row.result, {source, points}, {target_name_, target_},
                                model_.min_points());
      }
    } catch (const cloud_file::CloudFileError& error) {
      row.error = error.what();
    }
    return row;
  }

  std::string json(const std::vector<Row>& rows) const {
    Json results = Json::array();
    for (const Row& row : rows) {
      Json item{{"source", shown_text(row.source)}};
      if (row.error.empty()) {
        const AlignReport report{*row.result, model_.name(), arguments_.engine.options.mode, {}};
        item.update(Json::parse(to_json(report)));
      } else {
        item["status"] = row.result ? std::string(to_string(row.result->status)) : "unreadable";
        item["error"] = shown_text(row.error);
      }
      results.push_back(std::move(item));
    }
    const Json json{{"target", shown_text(target_name_)}, {"results", std::move(results)}};
    return json.dump(2) + "\n";
  }

 private:
  const AlignArguments& arguments_;
  std::string target_name_;
  Points target_;
  Model model_;
  Registrar registrar_;
};

std::string status_text(const Row& row) {
  const std::string status = row.result ? std::string(to_string(row.result->status)) : "unreadable";
  const std::string padded =
      status + std::string(16 - std::min<std::size_t>(status.size(), 15), ' ');
  const bool good = row.result && row.result->status == Status::ok;
  const Colour colour = good ? Colour::green : row.error.empty() ? Colour::yellow : Colour::red;
  return coloured(padded, colour, STDOUT_FILENO);
}

/// Status, confidence, turn and shift of every source; of a failure the reason.
std::string text(const std::vector<Row>& rows) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  for (const Row& row : rows) {
    text << status_text(row);
    if (!row.error.empty()) {
      text << shown_text(row.error) << '\n';
      continue;
    }
    const Result& result = *row.result;
    const Pose& pose = result.T_target_source;
    text << std::left << std::setw(8)
         << (std::isnan(result.confidence) ? "n/a" : number_text(result.confidence, 3))
         << std::setw(20) << number_text(axis_angle(pose).angle_deg, 4) + " degrees"
         << shown_text(row.source) << '\n';
  }
  return text.str();
}

ExitCode worst(const std::vector<Row>& rows) {
  ExitCode code = ExitCode::ok;
  for (const Row& row : rows) {
    const bool timed_out = row.result && row.result->status == Status::timed_out;
    if (!row.error.empty() && !timed_out) return ExitCode::input;
    if (!row.result || row.result->status != Status::ok) code = ExitCode::not_sure;
  }
  return code;
}

}  // namespace

Outcome align_many(const AlignArguments& arguments, const std::vector<std::string>& sources,
                   const std::string& target) {
  ManyAligner aligner(arguments, target);
  std::vector<Row> rows;
  {
    ProgressBar progress(0, sources.size(), arguments.quiet);
    for (const std::string& source : sources) {
      rows.push_back(aligner.align(source));
      progress.update(rows.size());
    }
  }
  return {worst(rows), arguments.json ? aligner.json(rows) : text(rows)};
}

}  // namespace vnreg::cli
