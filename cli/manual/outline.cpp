#include "manual/outline.hpp"

#include <sstream>

namespace vnreg::cli {
namespace {

/// CLI11 adds what a value may be to its name: MODE:{coarse,paper}, N:INT in [0 - 9].
void split_type(const std::string& type, OptionOutline& option) {
  const std::size_t colon = type.find(':');
  option.value = type.substr(0, colon);
  const std::size_t open = type.find('{');
  const std::size_t close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return;
  std::istringstream list(type.substr(open + 1, close - open - 1));
  for (std::string choice; std::getline(list, choice, ',');) option.choices.push_back(choice);
}

OptionOutline outline_of(const CLI::Option& declared) {
  OptionOutline option;
  option.positional = declared.get_positional();
  if (option.positional) option.names.push_back(declared.get_single_name());
  for (const std::string& name : declared.get_snames()) option.names.push_back("-" + name);
  for (const std::string& name : declared.get_lnames()) option.names.push_back("--" + name);
  if (declared.get_items_expected_max() > 0) split_type(declared.get_type_name(), option);
  option.description = declared.get_description();
  return option;
}

CommandOutline command_outline(const CLI::App& app) {
  CommandOutline command{app.get_name(), app.get_description(), app.get_footer(), {}};
  for (const CLI::Option* option : app.get_options())
    command.options.push_back(outline_of(*option));
  return command;
}

}  // namespace

bool OptionOutline::takes_file() const {
  return value.starts_with("FILE") || value.ends_with(".csv");
}

std::vector<CommandOutline> outline_of(const CLI::App& app) {
  std::vector<CommandOutline> commands{command_outline(app)};
  const auto all = [](const CLI::App*) { return true; };
  for (const CLI::App* command : app.get_subcommands(all)) {
    commands.push_back(command_outline(*command));
  }
  return commands;
}

}  // namespace vnreg::cli
