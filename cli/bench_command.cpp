#include "bench_command.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "bench/bench_clouds.hpp"
#include "engine_options.hpp"
#include "progress_bar.hpp"
#include "shown_text.hpp"

namespace vnreg::cli {
namespace {

constexpr std::size_t fewest_runs = 5;

struct Times {
  int points;
  Mode mode;
  int threads;
  std::size_t runs;
  double median_ms;
  double p90_ms;
};

/// What Linux calls the processor.
std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return shown_text(line.substr(line.find(':') + 2));
  }
  return "unknown";
}

int all_threads() {
  return std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 1024);
}

/// The modes that the model has.
std::vector<Mode> modes_of(const Model& model) {
  std::vector<Mode> modes;
  for (const Mode mode : {Mode::coarse, Mode::paper, Mode::verified}) {
    try {
      const Registrar registrar(model, {.mode = mode, .threads = 1});
      modes.push_back(mode);
    } catch (const Error&) {
      continue;  // a model without the fine register has no mode paper
    }
  }
  return modes;
}

Times measure(const Model& model, int points, Mode mode, int threads, double seconds) {
  using Clock = std::chrono::steady_clock;
  const cloud_file::Points source = bench_cloud(points, 1);
  const cloud_file::Points target = turned(bench_cloud(points, 2));
  Registrar registrar =
      make_registrar(model, {.mode = mode, .threads = threads, .max_points = points});
  registrar.align(source, target);  // once to warm the caches
  std::vector<double> ms;
  const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                   std::chrono::duration<double>(seconds));
  do {
    ms.push_back(registrar.align(source, target).ms.total);
  } while (ms.size() < fewest_runs || Clock::now() < end);
  std::ranges::sort(ms);
  return {points, mode, threads, ms.size(), ms[ms.size() / 2], ms[ms.size() * 9 / 10]};
}

std::vector<Times> measure_all(const BenchArguments& arguments, const Model& model) {
  std::vector<int> threads{1};
  if (all_threads() > 1) threads.push_back(all_threads());
  const std::vector<Mode> modes = modes_of(model);
  std::vector<Times> table;
  ProgressBar progress(0, arguments.points.size() * modes.size() * threads.size(), arguments.quiet);
  for (const Mode mode : modes) {
    for (const int points : arguments.points) {
      for (const int count : threads) {
        table.push_back(measure(model, points, mode, count, arguments.seconds));
        progress.update(table.size());
      }
    }
  }
  return table;
}

std::string to_text(const std::vector<Times>& table, const Model& model) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "processor  " << processor_name() << ", " << all_threads() << " threads\n"
       << "program    vnreg " << version() << " (" << instruction_set() << "), model "
       << shown_text(model.name()) << "\n\n"
       << "mode      points  threads  ms (median)  ms (90 %)  pairs a second\n";
  for (const Times& times : table) {
    text << std::left << std::setw(10) << to_string(times.mode) << std::right << std::setw(6)
         << times.points << std::setw(9) << times.threads << std::setw(13)
         << number_text(times.median_ms, 3) << std::setw(11) << number_text(times.p90_ms, 3)
         << std::setw(16) << number_text(1000 / times.median_ms, 3) << '\n';
  }
  return text.str();
}

std::string to_json(const std::vector<Times>& table, const Model& model) {
  nlohmann::ordered_json json{{"processor", processor_name()},
                              {"threads", all_threads()},
                              {"version", version()},
                              {"instruction_set", instruction_set()},
                              {"model", shown_text(model.name())}};
  json["times"] = nlohmann::ordered_json::array();
  for (const Times& times : table) {
    json["times"].push_back({{"mode", to_string(times.mode)},
                             {"points", times.points},
                             {"threads", times.threads},
                             {"runs", times.runs},
                             {"ms_median", times.median_ms},
                             {"ms_p90", times.p90_ms},
                             {"pairs_per_second", 1000 / times.median_ms}});
  }
  return json.dump(2) + "\n";
}

}  // namespace

CLI::App* add_bench_command(CLI::App& app, BenchArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "bench", "Measure how long one pair takes on this machine, by points, mode and threads.");
  command->add_option("--model", arguments.model, "Model file; default: the built-in model")
      ->type_name("FILE");
  command
      ->add_option("--points", arguments.points,
                   "Points of a cloud (64 to 16384), one number or several; default: 256 512 1024 "
                   "2048 4096")
      ->type_name("N")
      ->check(CLI::Range(64, 16384));
  command
      ->add_option("--seconds", arguments.seconds,
                   "How long each line of the table is measured; default 0.5")
      ->type_name("S")
      ->check(CLI::Range(0.0, 3600.0));
  command->add_flag("--json", arguments.json, "Print one JSON object instead of text");
  command->add_flag("--quiet", arguments.quiet, "No progress");
  command->footer(
      "Example: vnreg bench --json\n"
      "Two samples of a synthetic body, without reading files and loading the model.\n"
      "Exit codes: 0 done, 2 usage, 3 the model, 1 anything else.");
  return command;
}

Outcome run_bench(const BenchArguments& arguments) {
  const Model model = arguments.model.empty() ? Model::builtin() : load_model(arguments.model);
  const std::vector<Times> table = measure_all(arguments, model);
  return {ExitCode::ok, arguments.json ? to_json(table, model) : to_text(table, model)};
}

}  // namespace vnreg::cli
