// Which instructions this build uses.
#pragma once

namespace vnreg::detail {

/// For example "x86-64-v3". Data of a file that is compiled as the engine is; reading it runs none
/// of that file's code.
extern const char* const compiled_level;

}  // namespace vnreg::detail
