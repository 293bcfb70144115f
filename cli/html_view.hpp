// `vnreg align --html`: the viewer's page as a file.
#pragma once

#include <string>

#include "viewer/view.hpp"

namespace vnreg::cli {

/// Writes the page of the pair to the file at `path`. Throws CommandError (failure).
void write_html_view(const std::string& path, const viewer::ViewedPair& pair);

}  // namespace vnreg::cli
