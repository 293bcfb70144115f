// `vnreg align`: the pose between two cloud files, or of many onto one.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cloud_file/cloud_file.hpp"
#include "command.hpp"
#include "engine_options.hpp"

namespace vnreg::cli {

struct AlignArguments {
  std::vector<std::string> clouds;  // sources, then the target: files, "-" for standard input; a
                                    // source may also be a folder or a pattern
  std::string output;               // empty: the moved source is not written
  std::string html;                 // empty: no page is written
  std::optional<cloud_file::Format> format;  // of standard input; nothing: by its content
  bool json = false;
  bool quiet = false;
  EngineArguments engine;
};

/// Declares the command; the parse fills `arguments`.
CLI::App* add_align_command(CLI::App& app, AlignArguments& arguments);

/// Reads, aligns, writes the moved source if asked to. Throws CommandError or CloudFileError.
Outcome run_align(const AlignArguments& arguments);

}  // namespace vnreg::cli
