// The program's commands and options as they were declared: what the manual page and the
// completions of shells are made of, so that none can miss one.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace vnreg::cli {

struct OptionOutline {
  std::vector<std::string> names;    // "-o", "--output"; of a positional its one name
  std::string value;                 // what the value is called; empty: a flag
  std::vector<std::string> choices;  // the values it may have; empty: not a list
  std::string description;
  bool positional = false;

  /// Whether its value is the name of a file.
  bool takes_file() const;
};

struct CommandOutline {
  std::string name;
  std::string description;
  std::string footer;
  std::vector<OptionOutline> options;
};

/// First the program itself, then its commands.
std::vector<CommandOutline> outline_of(const CLI::App& app);

}  // namespace vnreg::cli
