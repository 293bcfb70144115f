#include "batch_command.hpp"

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "batch/align_pairs.hpp"
#include "batch/pair_table.hpp"
#include "batch/results_file.hpp"
#include "batch/run_record.hpp"
#include "interruption.hpp"
#include "progress_bar.hpp"
#include "shown_text.hpp"

namespace vnreg::cli {
namespace {

struct Summary {
  std::size_t pairs;
  std::size_t done_before;
  std::size_t done;
  double seconds;
  std::map<std::string, std::size_t> statuses;
};

std::string to_text(const Summary& summary, const std::string& output) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << summary.done << " of " << summary.pairs << " pairs in " << shown_text(output);
  if (summary.done_before > 0) text << ", " << summary.done_before << " of them from before";
  text << "; " << number_text(summary.seconds, 3) << " s\n";
  for (const auto& [status, count] : summary.statuses)
    text << "  " << status << ' ' << count << '\n';
  return text.str();
}

std::string to_json(const Summary& summary, const std::string& output) {
  const nlohmann::ordered_json json{
      {"output", shown_text(output)}, {"pairs", summary.pairs},
      {"done", summary.done},         {"done_before", summary.done_before},
      {"seconds", summary.seconds},   {"statuses", summary.statuses}};
  return json.dump(2) + "\n";
}

Summary align_all(const BatchArguments& arguments, const PairTable& table, const Model& model,
                  ResultsFile& results, const std::atomic<bool>& stop) {
  const std::string record = run_record(arguments.engine, model);
  const std::size_t first = results.begin_or_resume(table, record, arguments.overwrite);
  const auto begin = std::chrono::steady_clock::now();
  std::size_t done = first;
  {
    ProgressBar progress(first, table.pairs.size(), arguments.quiet);
    const auto keep = [&](const ResultRow& row) {
      results.add(row);
      progress.update(++done);
    };
    align_pairs({table, first, model, arguments.engine.options, arguments.threads}, keep, stop);
  }
  results.finish(done == table.pairs.size());
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  return {table.pairs.size(), first, done, seconds.count(), results.statuses()};
}

void refuse_own_table(const BatchArguments& arguments) {
  std::error_code ignored;
  if (std::filesystem::equivalent(arguments.pairs, arguments.output, ignored)) {
    throw CommandError(ExitCode::usage,
                       arguments.output + ": expected an output beside the table, found the table");
  }
}

}  // namespace

CLI::App* add_batch_command(CLI::App& app, BatchArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "batch", "Align all pairs of a table of files; a run that was killed goes on where it was.");
  command
      ->add_option("PAIRS", arguments.pairs,
                   "CSV with the columns source and target, and id if it has one; -: standard "
                   "input. Names are relative to its folder")
      ->type_name("PAIRS.csv")
      ->required();
  command
      ->add_option("-o,--output", arguments.output,
                   "The results, one row a pair: .csv, .jsonl or .parquet")
      ->check(CLI::Validator(check_results_name, ""))
      ->type_name("FILE")
      ->required();
  command->add_flag("--overwrite", arguments.overwrite, "Begin anew, whatever the output holds");
  add_engine_options(*command, arguments.engine);
  add_threads_option(*command, arguments.threads,
                     "Pairs at a time; 0 (default): one for each processor");
  command->add_flag("--json", arguments.json, "Print the summary as one JSON object");
  command->add_flag("--quiet", arguments.quiet, "No progress and no summary, errors only");
  command->footer(
      "Example: vnreg batch pairs.csv -o results.parquet\n"
      "The same command again goes on with what is missing. A pair that fails has its reason in "
      "its row.\n"
      "Exit codes: 0 every pair has its row, 2 usage, 3 the table or the model, 130 interrupted, "
      "1 anything else.");
  return command;
}

Outcome run_batch(const BatchArguments& arguments) {
  refuse_own_table(arguments);
  const PairTable table = read_pairs(arguments.pairs);
  const Model model = arguments.engine.load();
  make_registrar(model, arguments.engine.options);  // refuses options before anything is written
  const Interruption interruption;
  ResultsFile results(arguments.output);
  const Summary summary = align_all(arguments, table, model, results, interruption.flag());
  if (summary.done < summary.pairs) {
    throw CommandError(ExitCode::interrupted, "interrupted: " + std::to_string(summary.done) +
                                                  " of " + std::to_string(summary.pairs) +
                                                  " pairs are in " + arguments.output +
                                                  "; the same command goes on");
  }
  if (arguments.quiet) return {};
  return {ExitCode::ok,
          arguments.json ? to_json(summary, arguments.output) : to_text(summary, arguments.output)};
}

}  // namespace vnreg::cli
