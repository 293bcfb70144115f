// How the reader says what is wrong with a file, and where.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "vnreg/error.hpp"

namespace vnreg::model_format {

/// Throws Error (corrupt_model) about the field `name`, which starts at `byte` of the file.
[[noreturn]] inline void refuse(std::string_view name, std::uint64_t byte, std::string expected,
                                std::string got) {
  throw Error(ErrorCode::corrupt_model, std::string(name) + " (byte " + std::to_string(byte) + ")",
              std::move(expected), std::move(got));
}

}  // namespace vnreg::model_format
