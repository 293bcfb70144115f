// The options that every command which aligns clouds has in common.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "vnreg/vnreg.hpp"

namespace vnreg::cli {

struct EngineArguments {
  std::string model;  // empty: the built-in model
  Options options;

  /// Reads the model. Throws CommandError.
  Model load() const;
};

/// Declares `--model`, `--mode`, `--budget-ms`, `--max-points`, `--drop-non-finite`, `--seed`.
void add_engine_options(CLI::App& command, EngineArguments& arguments);

/// Declares `--threads`; `meaning` is its help.
void add_threads_option(CLI::App& command, int& threads, const std::string& meaning);

}  // namespace vnreg::cli
