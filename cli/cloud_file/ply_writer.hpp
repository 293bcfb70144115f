// Writes a cloud as PLY.
#pragma once

#include <string>

#include "cloud_file/cloud_file.hpp"

namespace vnreg::cloud_file {

/// Writes binary little-endian PLY with double x, y, z. The file appears at `path` complete or not
/// at all: it is written beside it and renamed. Throws CloudFileError, whose text begins with the
/// path, where that fails; then nothing is left behind and an older file at `path` is untouched.
void write_ply(const std::string& path, const Points& points);

}  // namespace vnreg::cloud_file
