#include "manual_command.hpp"

#include "manual/completion.hpp"
#include "manual/man_page.hpp"
#include "manual/outline.hpp"

namespace vnreg::cli {

CLI::App* add_completion_command(CLI::App& app, CompletionArguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "completion", "Print the script that completes vnreg's options in a shell.");
  command->add_option("SHELL", arguments.shell, "The shell")
      ->type_name("SHELL")
      ->check(CLI::IsMember({"bash", "zsh"}))
      ->required();
  command->footer(
      "Example: vnreg completion bash > ~/.local/share/bash-completion/completions/vnreg");
  return command;
}

CLI::App* add_manual_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("manual", "Print the manual page, for man.");
  command->footer("Example: vnreg manual | man -l -");
  return command;
}

Outcome run_completion(const CLI::App& app, const CompletionArguments& arguments) {
  const auto commands = outline_of(app);
  return {ExitCode::ok,
          arguments.shell == "bash" ? bash_completion(commands) : zsh_completion(commands)};
}

Outcome run_manual(const CLI::App& app) { return {ExitCode::ok, man_page(outline_of(app))}; }

}  // namespace vnreg::cli
