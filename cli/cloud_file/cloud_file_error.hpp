// The one exception of the cloud files, and how its text is put together.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace vnreg::cloud_file {

/// What is wrong with a file: where, what was expected, what was found. Its text is one line.
class CloudFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// `text`, such as the name of a file, on one line: control characters, those of U+0080 to U+009F
/// too, become \xNN.
std::string one_line(std::string_view text);

/// `text` from inside a file, in single quotes: bytes that are not printable ASCII become \xNN,
/// more than 40 are cut off; an empty text is called nothing.
std::string quoted(std::string_view text);

/// Throws "expected <expected>, found <found>".
[[noreturn]] void fail(std::string_view expected, std::string_view found);
/// Throws "line <line>: expected <expected>, found <found>"; lines count from 1.
[[noreturn]] void fail_at_line(std::size_t line, std::string_view expected, std::string_view found);
/// Throws "byte <offset>: expected <expected>, found <found>"; offsets count from 0.
[[noreturn]] void fail_at_byte(std::size_t offset, std::string_view expected,
                               std::string_view found);

}  // namespace vnreg::cloud_file
