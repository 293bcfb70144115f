// Point clouds from and to files. PLY, PCD, OBJ, OFF, rows of text and NPY are read; PLY is
// written.
//
// Every reader checks the sizes that a file claims against the bytes that it has before it
// allocates, so memory never exceeds a small multiple of the file. Coordinates are returned as they
// are written: NaN and infinities included, viewpoints, normals and colours ignored.
#pragma once

#include <array>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cloud_file/cloud_file_error.hpp"

namespace vnreg::cloud_file {

/// N points, each x, y, z in the units of the file.
using Points = std::vector<std::array<double, 3>>;

enum class Format { ply, pcd, obj, off, text, npy };

/// The formats that read_cloud knows, as a phrase for messages.
inline constexpr std::string_view known_formats = "PLY, PCD, OBJ, OFF, XYZ, TXT, CSV or NPY";

/// The format of `bytes`: by its first bytes, then by the extension of `path` (case does not
/// matter), then as text if its first row is three or more numbers. Nothing if none fits.
std::optional<Format> detect_format(std::string_view bytes, std::string_view path);

/// Reads the points of a file that is already in memory; `path` only helps to choose the format.
/// Throws CloudFileError, without the name of the file.
Points parse_cloud(std::string_view bytes, std::string_view path);

/// Reads the points of a file that is already in memory and has this format. Throws as above.
Points parse_cloud_as(Format format, std::string_view bytes);

/// All bytes of the file at `path`, or of an open file from where it stands. Throws CloudFileError,
/// without the name of the file.
std::string read_bytes(const std::string& path);
std::string read_bytes(std::FILE* file);

/// The format whose usual extension is `extension`, without its dot; case does not matter.
std::optional<Format> format_of_extension(std::string_view extension);

/// Reads the points of the file at `path` (a pipe works too). Throws CloudFileError, whose text
/// begins with the path and is one line.
Points read_cloud(const std::string& path);

}  // namespace vnreg::cloud_file
