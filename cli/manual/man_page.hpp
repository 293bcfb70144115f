// The manual page.
#pragma once

#include <string>
#include <vector>

#include "manual/outline.hpp"

namespace vnreg::cli {

/// vnreg(1) in the language of man(7).
std::string man_page(const std::vector<CommandOutline>& commands);

}  // namespace vnreg::cli
