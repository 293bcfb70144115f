#include "manual/completion.hpp"

namespace vnreg::cli {
namespace {

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

std::vector<std::string> command_names(const std::vector<CommandOutline>& commands) {
  std::vector<std::string> names;
  for (std::size_t i = 1; i < commands.size(); ++i) names.push_back(commands[i].name);
  return names;
}

// ---- bash ----

/// What may stand where an option may: the names of the options, and of a positional its choices.
std::vector<std::string> bash_words(const CommandOutline& command) {
  std::vector<std::string> words;
  for (const OptionOutline& option : command.options) {
    const auto& more = option.positional ? option.choices : option.names;
    words.insert(words.end(), more.begin(), more.end());
  }
  return words;
}

/// The branch of an option with a value: its choices, or files, or nothing.
std::string bash_value(const CommandOutline& command, const OptionOutline& option) {
  std::vector<std::string> patterns;
  for (const std::string& name : option.names)
    patterns.push_back("'" + command.name + ' ' + name + "'");
  std::string action = "compopt +o default";
  if (option.takes_file()) action = "COMPREPLY=()";
  if (!option.choices.empty()) {
    action = "COMPREPLY=($(compgen -W '" + joined(option.choices, " ") + "' -- \"$current\"))";
  }
  return "    " + joined(patterns, "|") + ") " + action + "; return ;;\n";
}

std::string bash_values(const std::vector<CommandOutline>& commands) {
  std::string text;
  for (const CommandOutline& command : commands) {
    for (const OptionOutline& option : command.options) {
      if (!option.positional && !option.value.empty()) text += bash_value(command, option);
    }
  }
  return text;
}

// ---- zsh ----

/// `text` inside of '...' and of [...] of _arguments.
std::string zsh_text(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\'') {
      escaped += "'\\''";
    } else if (c == '[' || c == ']' || c == ':' || c == '\\') {
      escaped += std::string("\\") + c;
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string zsh_value(const OptionOutline& option) {
  std::string action = option.takes_file() ? "_files" : " ";
  if (!option.choices.empty()) action = "(" + joined(option.choices, " ") + ")";
  return ":" + zsh_text(option.value) + ":" + action;
}

std::string zsh_option(const OptionOutline& option) {
  if (option.positional) return "'*" + zsh_value(option) + "'";
  const std::string value = option.value.empty() ? "" : zsh_value(option);
  const std::string text = "[" + zsh_text(option.description) + "]" + value + "'";
  if (option.names.size() == 1) return "'" + option.names.front() + text;
  return "'(" + joined(option.names, " ") + ")'{" + joined(option.names, ",") + "}'" + text;
}

std::string zsh_arguments(const CommandOutline& command, const std::string& indent) {
  std::string text = "_arguments -S";
  for (const OptionOutline& option : command.options) {
    text += " \\\n" + indent + zsh_option(option);
  }
  return text;
}

}  // namespace

std::string bash_completion(const std::vector<CommandOutline>& commands) {
  const std::string names = joined(command_names(commands), "|");
  std::string text =
      "# bash completion of vnreg; made by: vnreg completion bash\n"
      "_vnreg() {\n"
      "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}\n"
      "  local command=vnreg word\n"
      "  COMPREPLY=()\n"
      "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
      "    case $word in " +
      names +
      ") command=$word; break ;; esac\n"
      "  done\n"
      "  case \"$command $previous\" in\n" +
      bash_values(commands) +
      "  esac\n"
      "  local words\n"
      "  case $command in\n";
  for (const CommandOutline& command : commands) {
    text += "    " + command.name + ") words='" + joined(bash_words(command), " ") + "' ;;\n";
  }
  text +=
      "  esac\n"
      "  [[ $command == vnreg ]] && words+=' " +
      joined(command_names(commands), " ") +
      "'\n"
      "  # Without a dash, bash itself completes files where no word fits.\n"
      "  if [[ $current == -* || $words != -* || $command == vnreg || $command == completion ]]; "
      "then\n"
      "    COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
      "  fi\n"
      "}\n"
      "complete -o default -F _vnreg vnreg\n";
  return text;
}

std::string zsh_completion(const std::vector<CommandOutline>& commands) {
  std::string text =
      "#compdef vnreg\n"
      "# zsh completion of vnreg; made by: vnreg completion zsh\n"
      "_vnreg() {\n"
      "  local -a commands=(\n";
  for (std::size_t i = 1; i < commands.size(); ++i) {
    text += "    '" + commands[i].name + ":" + zsh_text(commands[i].description) + "'\n";
  }
  text +=
      "  )\n"
      "  if (( CURRENT == 2 )) && [[ $words[2] != -* ]]; then\n"
      "    _describe -t commands command commands\n"
      "    return\n"
      "  fi\n"
      "  local command=$words[2]\n"
      "  case $command in\n";
  for (std::size_t i = 1; i < commands.size(); ++i) {
    text += "    " + commands[i].name + ")\n      shift words; (( CURRENT-- ))\n      " +
            zsh_arguments(commands[i], "        ") + " ;;\n";
  }
  return text + "    *)\n      " + zsh_arguments(commands.front(), "        ") +
         " ;;\n  esac\n}\n"
         "if [[ $funcstack[1] == _vnreg ]]; then _vnreg \"$@\"; else compdef _vnreg vnreg; fi\n";
}

}  // namespace vnreg::cli
