// What errors about a model file must be like.
#pragma once

#include "require.hpp"
#include "vnreg/error.hpp"

namespace vnreg::fuzz {

inline void check(const Error& error) {
  require(!error.field().empty() && !error.expected().empty() && !error.got().empty(),
          "an error says where it is, what was expected and what was found");
  require(error.code() != ErrorCode::invalid_option && error.code() != ErrorCode::file_unreadable,
          "the code is about the content");
  const std::string_view text = error.what();
  require(text.size() < 1000, "the message is short");
  for (const char c : text) {
    require(c >= 0x20 && c < 0x7f, "the message is one line that a terminal can show");
  }
}

}  // namespace vnreg::fuzz
