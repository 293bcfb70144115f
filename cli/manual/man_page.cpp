#include "manual/man_page.hpp"

#include <sstream>

#include "command.hpp"

namespace vnreg::cli {
namespace {

/// Text as roff takes it: dashes stay dashes, and no line begins with a control character.
std::string roff(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\e";
    } else if (c == '-') {
      escaped += "\\-";
    } else {
      escaped += c;
    }
  }
  const bool is_control = escaped.starts_with('.') || escaped.starts_with('\'');
  return is_control ? "\\&" + escaped : escaped;
}

std::string names_of(const OptionOutline& option) {
  std::string text;
  for (const std::string& name : option.names) {
    text += (text.empty() ? "\\fB" : ", \\fB") + roff(name) + "\\fR";
  }
  return text;
}

std::string option_entry(const OptionOutline& option) {
  std::string text = ".TP\n" + names_of(option);
  if (!option.positional && !option.value.empty()) text += " \\fI" + roff(option.value) + "\\fR";
  text += '\n' + roff(option.description);
  if (!option.choices.empty()) {
    text += "; one of";
    for (const std::string& choice : option.choices) text += ' ' + roff(choice);
  }
  return text + ".\n";
}

std::string options_of(const CommandOutline& command) {
  std::string text;
  for (const bool positional : {true, false}) {
    for (const OptionOutline& option : command.options) {
      if (option.positional == positional) text += option_entry(option);
    }
  }
  return text;
}

std::string lines_of(const std::string& footer) {
  std::string text;
  std::istringstream lines(footer);
  for (std::string line; std::getline(lines, line);) text += ".PP\n" + roff(line) + '\n';
  return text;
}

std::string synopsis(const CommandOutline& command) {
  std::string text = ".B vnreg " + command.name + "\n";
  text += "[\\fIOPTIONS\\fR]";
  for (const OptionOutline& option : command.options) {
    if (option.positional) text += " \\fI" + roff(option.names.front()) + "\\fR";
  }
  return text + "\n.br\n";
}

std::string exit_status() {
  std::string text = ".SH EXIT STATUS\n";
  for (const ExitMeaning& exit : exit_meanings) {
    text += ".TP\n.B " + std::to_string(static_cast<int>(exit.code)) + '\n' +
            roff(std::string(exit.meaning)) + ".\n";
  }
  return text;
}

}  // namespace

std::string man_page(const std::vector<CommandOutline>& commands) {
  std::string text = ".TH VNREG 1 \"\" \"vnreg " + std::string(version()) +
                     "\" \"User Commands\"\n.SH NAME\n"
                     "vnreg \\- the rigid pose between two point clouds\n.SH SYNOPSIS\n";
  for (std::size_t i = 1; i < commands.size(); ++i) text += synopsis(commands[i]);
  text += ".SH DESCRIPTION\n" + roff(commands.front().description) +
          "\nResults go to standard output. An error is one line on standard error.\n"
          ".SH OPTIONS\n" +
          options_of(commands.front());
  for (std::size_t i = 1; i < commands.size(); ++i) {
    text += ".SS vnreg " + commands[i].name + '\n' + roff(commands[i].description) + '\n' +
            options_of(commands[i]) + lines_of(commands[i].footer);
  }
  return text + exit_status() +
         ".SH ENVIRONMENT\n.TP\n.B NO_COLOR\nIf it is set and not empty, nothing is coloured.\n"
         ".TP\n.B OMP_NUM_THREADS\nHow many threads align uses without \\fB\\-\\-threads\\fR.\n";
}

}  // namespace vnreg::cli
