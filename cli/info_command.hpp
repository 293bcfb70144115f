// `vnreg info`: what a model file holds.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "command.hpp"

namespace vnreg::cli {

struct InfoArguments {
  std::string model;
  bool json = false;
};

/// Declares the command; the parse fills `arguments`.
CLI::App* add_info_command(CLI::App& app, InfoArguments& arguments);

/// Metadata, tensors and totals of any valid `.vnr` file. Throws CommandError.
Outcome run_info(const InfoArguments& arguments);

}  // namespace vnreg::cli
