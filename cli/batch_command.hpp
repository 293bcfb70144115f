// `vnreg batch`: the poses of all pairs of a table.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "command.hpp"
#include "engine_options.hpp"

namespace vnreg::cli {

struct BatchArguments {
  std::string pairs;
  std::string output;
  EngineArguments engine;
  int threads = 0;
  bool overwrite = false;
  bool quiet = false;
  bool json = false;
};

/// Declares the command; the parse fills `arguments`.
CLI::App* add_batch_command(CLI::App& app, BatchArguments& arguments);

/// Aligns the pairs that have no row yet. Throws CommandError.
Outcome run_batch(const BatchArguments& arguments);

}  // namespace vnreg::cli
