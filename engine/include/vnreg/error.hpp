/// @file
/// The one exception type of the library. Building and loading throw it; Registrar::align never
/// throws.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "vnreg/export.hpp"

namespace vnreg {

/// The kind of a failure.
enum class ErrorCode {
  file_unreadable,      ///< the file cannot be opened or read
  not_a_model,          ///< the magic bytes are wrong
  unsupported_version,  ///< written by a newer major version
  corrupt_model,        ///< a field, checksum, offset or size contradicts the specification
  wrong_architecture,   ///< valid file, but not an architecture this build can run
  missing_tensor,       ///< a name or shape of the architecture is absent or different
  invalid_option,       ///< an Options field is out of its range
  unsupported_cpu,      ///< this build needs instructions that the processor lacks
  invalid_points,       ///< a cloud's layout cannot be read
};

/// The code's name as it is written here.
VNREG_API std::string_view to_string(ErrorCode code) noexcept;

/// A failure with everything needed to act on it: what is wrong, where, and both values.
class VNREG_API Error : public std::runtime_error {
 public:
  /// The message is "field: expected ..., got ...".
  Error(ErrorCode code, std::string field, std::string expected, std::string got)
      : std::runtime_error(field + ": expected " + expected + ", got " + got),
        code_(code),
        field_(std::move(field)),
        expected_(std::move(expected)),
        got_(std::move(got)) {}

  /// The kind of the failure.
  ErrorCode code() const noexcept { return code_; }
  /// What is wrong: a file, a field of a file, an option.
  const std::string& field() const noexcept { return field_; }
  /// What it should be.
  const std::string& expected() const noexcept { return expected_; }
  /// What it is.
  const std::string& got() const noexcept { return got_; }

 private:
  ErrorCode code_;
  std::string field_;
  std::string expected_;
  std::string got_;
};

}  // namespace vnreg
