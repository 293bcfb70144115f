// The program `vnreg`. Results go to stdout, one line of error to stderr, never both.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <functional>
#include <iostream>
#include <new>
#include <vector>

#include "align_command.hpp"
#include "batch_command.hpp"
#include "bench_command.hpp"
#include "cloud_file/cloud_file_error.hpp"
#include "command.hpp"
#include "info_command.hpp"
#include "manual_command.hpp"
#include "selftest_command.hpp"
#include "terminal.hpp"

namespace {

using vnreg::cli::CommandError;
using vnreg::cli::ExitCode;
using vnreg::cli::Outcome;

int complain(ExitCode code, const std::string& message) {
  std::cerr << vnreg::cli::coloured("vnreg:", vnreg::cli::Colour::red, STDERR_FILENO) << ' '
            << vnreg::cloud_file::one_line(message) << '\n';
  return static_cast<int>(code);
}

int print(const Outcome& outcome) {
  std::cout << outcome.text << std::flush;
  if (!std::cout) return complain(ExitCode::failure, "standard output: expected room, found none");
  return static_cast<int>(outcome.code);
}

/// The first sentence of a message of CLI11, which may span lines.
std::string first_line(const std::string& message) { return message.substr(0, message.find('\n')); }

int run_command(const std::function<Outcome()>& run) {
  try {
    return print(run());
  } catch (const CommandError& error) {
    return complain(error.code(), error.what());
  } catch (const vnreg::Error& error) {
    const CommandError command_error = vnreg::cli::command_error(error, "");
    return complain(command_error.code(), command_error.what());
  } catch (const vnreg::cloud_file::CloudFileError& error) {
    return complain(ExitCode::input, error.what());
  } catch (const std::bad_alloc&) {
    return complain(ExitCode::failure, "expected more memory than the machine gives");
  } catch (const std::exception& error) {
    return complain(ExitCode::failure, error.what());
  }
}

/// What the parse fills.
struct Arguments {
  vnreg::cli::AlignArguments align;
  vnreg::cli::BatchArguments batch;
  vnreg::cli::BenchArguments bench;
  vnreg::cli::CompletionArguments completion;
  vnreg::cli::InfoArguments info;
  vnreg::cli::SelftestArguments selftest;
};

struct Command {
  const CLI::App* app;
  std::function<Outcome()> run;
};

std::vector<Command> add_commands(CLI::App& app, Arguments& arguments) {
  using namespace vnreg::cli;
  Arguments& a = arguments;
  return {
      {add_align_command(app, a.align), [&a] { return run_align(a.align); }},
      {add_batch_command(app, a.batch), [&a] { return run_batch(a.batch); }},
      {add_bench_command(app, a.bench), [&a] { return run_bench(a.bench); }},
      {add_info_command(app, a.info), [&a] { return run_info(a.info); }},
      {add_selftest_command(app, a.selftest), [&a] { return run_selftest(a.selftest); }},
      {add_completion_command(app, a.completion),
       [&app, &a] { return run_completion(app, a.completion); }},
      {add_manual_command(app), [&app] { return run_manual(app); }},
  };
}

int run(int argc, char** argv) {
  CLI::App app{"vnreg: the rigid pose between two point clouds, from any starting pose.", "vnreg"};
  app.set_version_flag("--version", std::string("vnreg ") + std::string(vnreg::version()) + " (" +
                                        std::string(vnreg::instruction_set()) + ")");
  app.require_subcommand(1);
  app.footer(
      "Example: vnreg align source.ply target.ply\n"
      "Exit codes: 0 done, 2 usage, 3 input, 4 not sure (low confidence), 1 anything else.");
  Arguments arguments;
  const std::vector<Command> commands = add_commands(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked_for) {  // --help, --version
    return app.exit(asked_for);
  } catch (const CLI::ParseError& error) {
    return complain(ExitCode::usage, first_line(error.what()) + " (see vnreg --help)");
  }
  const auto parsed = [](const Command& command) { return command.app->parsed(); };
  return run_command(std::ranges::find_if(commands, parsed)->run);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    return complain(ExitCode::failure, error.what());
  }
}
