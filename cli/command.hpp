// What the commands of the program share: exit codes, the result of a command, and its failure.
#pragma once

#include <stdexcept>
#include <string>

#include "vnreg/error.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::cli {

/// The program's exit codes, as docs/cli.md promises them.
enum class ExitCode {
  ok = 0,
  failure = 1,   // the machine: the output cannot be written, no memory, processor too old; a
                 // selftest that differs
  usage = 2,     // the command line
  input = 3,     // a cloud or a model file
  not_sure = 4,  // a pose was found, but with low confidence, or others fit as well
};

/// What a command has to say on stdout, and the exit code.
struct Outcome {
  ExitCode code = ExitCode::ok;
  std::string text;
};

/// A failure of a command: one line for stderr and the exit code. Nothing goes to stdout.
class CommandError : public std::runtime_error {
 public:
  CommandError(ExitCode code, const std::string& message)
      : std::runtime_error(message), code_(code) {}
  ExitCode code() const noexcept { return code_; }

 private:
  ExitCode code_;
};

/// The library's error as the program reports it; `path` is the file it was about (may be empty).
CommandError command_error(const Error& error, const std::string& path);

/// Reads the model at `path`; throws CommandError that names the file.
Model load_model(const std::string& path);

/// Throws CommandError for options that the model has no use for.
Registrar make_registrar(const Model& model, const Options& options);

/// `value` with `digits` significant digits, the same in every locale.
std::string number_text(double value, int digits);

}  // namespace vnreg::cli
