// What every message must be like that a terminal gets to see.
#pragma once

#include <string_view>

#include "require.hpp"

namespace vnreg::fuzz {

inline void check_message(std::string_view text) {
  require(!text.empty() && text.size() < 1000, "the message is short");
  for (const char c : text) {
    require(static_cast<unsigned char>(c) >= 0x20, "the message is one printable line");
  }
}

}  // namespace vnreg::fuzz
