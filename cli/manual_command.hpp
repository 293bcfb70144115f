// `vnreg completion` and `vnreg manual`: the program describes itself.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "command.hpp"

namespace vnreg::cli {

struct CompletionArguments {
  std::string shell;
};

/// Declares `completion`; the parse fills `arguments`.
CLI::App* add_completion_command(CLI::App& app, CompletionArguments& arguments);

/// Declares `manual`, which has no arguments.
CLI::App* add_manual_command(CLI::App& app);

/// The completion script of `app`, the whole program.
Outcome run_completion(const CLI::App& app, const CompletionArguments& arguments);

/// The manual page of `app`, the whole program.
Outcome run_manual(const CLI::App& app);

}  // namespace vnreg::cli
