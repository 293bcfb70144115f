// What depends on whether a person is looking: colours and the width of lines.
#pragma once

#include <string>
#include <string_view>

namespace vnreg::cli {

/// True if `descriptor` (1: stdout, 2: stderr) is a terminal that understands more than lines.
bool is_terminal(int descriptor);

/// Columns of that terminal; 80 where it does not say.
int terminal_width(int descriptor);

enum class Colour { green, yellow, red };

/// `text` in a colour if `descriptor` is a terminal and NO_COLOR is unset or empty
/// (no-color.org); else `text`.
std::string coloured(std::string_view text, Colour colour, int descriptor);

}  // namespace vnreg::cli
