// One reader per format. Each takes the bytes of a whole file, returns its points in the order of
// the file, and throws CloudFileError (without the file's name) where the bytes break the format.
#pragma once

#include <string_view>

#include "cloud_file/cloud_file.hpp"

namespace vnreg::cloud_file {

/// Stanford PLY 1.0: ascii, binary little and big endian; the x, y, z of the element `vertex`.
Points read_ply(std::string_view bytes);
/// Point Cloud Data 0.5 to 0.7: ascii, binary, binary_compressed; the fields x, y, z.
Points read_pcd(std::string_view bytes);
/// Wavefront OBJ: the `v` lines; faces and the rest are skipped.
Points read_obj(std::string_view bytes);
/// Geomview OFF with any of the prefixes ST, C, N: the vertices.
Points read_off(std::string_view bytes);
/// Rows of text, three numbers or more each; see text_reader.cpp for the rules.
Points read_text(std::string_view bytes);
/// NumPy array of shape (N, 3 or more): the first three columns.
Points read_npy(std::string_view bytes);

/// True if the first row of `bytes` is three or more numbers, so that read_text can begin.
bool starts_with_row_of_numbers(std::string_view bytes);
/// True if `word` is the keyword of an OFF file, with or without a number stuck to it.
bool is_off_keyword(std::string_view word);

}  // namespace vnreg::cloud_file
