// `vnreg selftest`: replays a golden file and compares every stage of the computation.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "command.hpp"

namespace vnreg::cli {

struct SelftestArguments {
  std::string model;   // empty: vnreg.vnr as installed, or in the source tree
  std::string golden;  // empty: the file named like the model, with .golden.vnr
};

/// Declares the command; the parse fills `arguments`.
CLI::App* add_selftest_command(CLI::App& app, SelftestArguments& arguments);

/// One line per stage of the golden file; ExitCode::failure if any differs. Throws CommandError.
Outcome run_selftest(const SelftestArguments& arguments);

}  // namespace vnreg::cli
