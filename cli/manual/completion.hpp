// What a shell needs to complete the program's commands, options and values.
#pragma once

#include <string>
#include <vector>

#include "manual/outline.hpp"

namespace vnreg::cli {

/// A script for bash, to be sourced or put into share/bash-completion/completions/vnreg.
std::string bash_completion(const std::vector<CommandOutline>& commands);

/// A function for zsh, to be put into a folder of fpath as _vnreg.
std::string zsh_completion(const std::vector<CommandOutline>& commands);

}  // namespace vnreg::cli
