// What the commands of the program share: exit codes, the result of a command, and its failure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "vnreg/error.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::cli {

/// The program's exit codes, as docs/cli.md promises them.
enum class ExitCode {
  ok = 0,
  failure = 1,        // the machine: the output cannot be written, no memory, processor too old; a
                      // selftest that differs
  usage = 2,          // the command line
  input = 3,          // a cloud or a model file
  not_sure = 4,       // a pose was found, but with low confidence, or others fit as well
  interrupted = 130,  // by SIGINT or SIGTERM; what is done is kept
};

struct ExitMeaning {
  ExitCode code;
  std::string_view meaning;
};

/// What the manual page says of them.
inline constexpr std::array<ExitMeaning, 6> exit_meanings{{
    {ExitCode::ok, "Done: aligned, shown, every stage equal, every pair has its row"},
    {ExitCode::failure,
     "Anything else: the output cannot be written, no memory, a selftest that differs"},
    {ExitCode::usage, "Usage: an unknown option, a value out of its range"},
    {ExitCode::input, "Input: a cloud, a table or a model cannot be used"},
    {ExitCode::not_sure, "Not sure: a pose was found, but it is not to be trusted blindly"},
    {ExitCode::interrupted, "Interrupted; what is done is kept"},
}};

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

/// The head checksum that identifies a `.vnr` file (model_format/SPEC.md, header field 10).
std::uint64_t head_checksum(std::span<const std::byte> file);

/// `value` with `digits` significant digits, the same in every locale.
std::string number_text(double value, int digits);

}  // namespace vnreg::cli
