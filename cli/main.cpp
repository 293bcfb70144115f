// The program `vnreg`. Results go to stdout, one line of error to stderr, never both.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <new>

#include "align_command.hpp"
#include "cloud_file/cloud_file_error.hpp"
#include "command.hpp"
#include "info_command.hpp"
#include "selftest_command.hpp"

namespace {

using vnreg::cli::CommandError;
using vnreg::cli::ExitCode;
using vnreg::cli::Outcome;

int complain(ExitCode code, const std::string& message) {
  std::cerr << "vnreg: " << vnreg::cloud_file::one_line(message) << '\n';
  return static_cast<int>(code);
}

int print(const Outcome& outcome) {
  std::cout << outcome.text << std::flush;
  if (!std::cout) return complain(ExitCode::failure, "standard output: expected room, found none");
  return static_cast<int>(outcome.code);
}

/// The first sentence of a message of CLI11, which may span lines.
std::string first_line(const std::string& message) { return message.substr(0, message.find('\n')); }

template <class Run>
int run_command(Run run) {
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

int run(int argc, char** argv) {
  CLI::App app{"vnreg: the rigid pose between two point clouds, from any starting pose.", "vnreg"};
  app.set_version_flag("--version", std::string("vnreg ") + std::string(vnreg::version()) + " (" +
                                        std::string(vnreg::instruction_set()) + ")");
  app.require_subcommand(1);
  app.footer(
      "Example: vnreg align source.ply target.ply\n"
      "Exit codes: 0 done, 2 usage, 3 input, 4 not sure (low confidence), 1 anything else.");
  vnreg::cli::AlignArguments align;
  vnreg::cli::InfoArguments info;
  vnreg::cli::SelftestArguments selftest;
  const CLI::App* align_command = add_align_command(app, align);
  const CLI::App* info_command = add_info_command(app, info);
  add_selftest_command(app, selftest);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked_for) {  // --help, --version
    return app.exit(asked_for);
  } catch (const CLI::ParseError& error) {
    return complain(ExitCode::usage, first_line(error.what()) + " (see vnreg --help)");
  }
  if (align_command->parsed()) return run_command([&] { return run_align(align); });
  if (info_command->parsed()) return run_command([&] { return run_info(info); });
  return run_command([&] { return run_selftest(selftest); });
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    return complain(ExitCode::failure, error.what());
  }
}
