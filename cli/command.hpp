// What the commands of the program share: exit codes, the result of a command, and its failure.
#pragma once

#include <optional>
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
  not_sure = 4,  // a pose was found, with low confidence
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

/// A registrar, and the mode that it runs in.
struct ModeRegistrar {
  Registrar registrar;
  Mode mode;
};

/// A registrar in the mode that is asked for; without one, in mode paper where the model has a fine
/// register and in mode coarse where it has none. Throws CommandError.
ModeRegistrar make_registrar(const Model& model, Options options, std::optional<Mode> mode);

/// `value` with `digits` significant digits, the same in every locale.
std::string number_text(double value, int digits);

}  // namespace vnreg::cli
