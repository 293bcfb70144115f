// `vnreg align`: the pose between two cloud files.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "command.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::cli {

struct AlignArguments {
  std::string source;
  std::string target;
  std::string output;  // empty: the moved source is not written
  std::string html;    // empty: no page is written
  std::string model;   // empty: the built-in model
  bool json = false;
  Options options;
};

/// Declares the command; the parse fills `arguments`.
CLI::App* add_align_command(CLI::App& app, AlignArguments& arguments);

/// Reads, aligns, writes the moved source and the page if asked to. Throws CommandError or
/// CloudFileError.
Outcome run_align(const AlignArguments& arguments);

}  // namespace vnreg::cli
