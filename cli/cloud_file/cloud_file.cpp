#include "cloud_file/cloud_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>

#include "cloud_file/readers.hpp"
#include "cloud_file/text_scan.hpp"

namespace vnreg::cloud_file {
namespace {

/// Larger files are refused: their points would not fit the memory of a usual machine.
constexpr std::size_t max_file_bytes = std::size_t{8} << 30U;

// ---- the format ----

bool is_pcd_word(std::string_view word) {
  return word == "VERSION" || word == "FIELDS" || word == "COLUMNS";
}

bool is_obj_vertex(std::string_view line) {
  std::string_view rest = line;
  return next_word(rest) == "v" && parse_number(next_word(rest)).has_value();
}

/// The format that the first bytes prove.
std::optional<Format> format_by_content(std::string_view bytes) {
  if (bytes.starts_with("\x93NUMPY")) return Format::npy;
  LineReader lines(bytes);
  while (const auto line = lines.next()) {
    const std::string_view content = trimmed(*line);
    if (lines.line_number() == 1 && content == "ply") return Format::ply;
    if (content.starts_with("# .PCD")) return Format::pcd;
    if (content.empty() || content.starts_with('#')) continue;
    std::string_view rest = content;
    const std::string_view word = next_word(rest);
    if (is_pcd_word(word)) return Format::pcd;
    if (is_off_keyword(word)) return Format::off;
    if (word == "mtllib" || is_obj_vertex(content)) return Format::obj;
    return std::nullopt;
  }
  return std::nullopt;
}

std::optional<Format> format_by_extension(std::string_view path) {
  const std::size_t dot = path.rfind('.');
  if (dot == std::string_view::npos) return std::nullopt;
  return format_of_extension(path.substr(dot + 1));
}

// ---- the bytes ----

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

[[noreturn]] void fail_to_read(int error) { fail("a file that can be read", std::strerror(error)); }

}  // namespace

std::optional<Format> format_of_extension(std::string_view extension) {
  std::string name(extension);
  std::ranges::transform(name, name.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  static constexpr std::pair<std::string_view, Format> extensions[] = {
      {"ply", Format::ply},  {"pcd", Format::pcd},  {"obj", Format::obj},  {"off", Format::off},
      {"xyz", Format::text}, {"txt", Format::text}, {"csv", Format::text}, {"npy", Format::npy},
  };
  for (const auto& [known, format] : extensions) {
    if (known == name) return format;
  }
  return std::nullopt;
}

std::string read_bytes(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) fail("a file", "a directory");
  const File file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) fail_to_read(errno);
  return read_bytes(file.get());
}

// In growing pieces, so that pipes work and no size is believed.
std::string read_bytes(std::FILE* file) {
  std::string bytes;
  std::size_t piece = std::size_t{1} << 16U;
  for (;;) {
    const std::size_t old_size = bytes.size();
    bytes.resize(old_size + piece);
    const std::size_t got = std::fread(bytes.data() + old_size, 1, piece, file);
    bytes.resize(old_size + got);
    if (got < piece) break;
    if (bytes.size() > max_file_bytes) fail("a file of at most 8 GiB", "more");
    piece = bytes.size();
  }
  if (std::ferror(file) != 0) fail_to_read(errno);
  return bytes;
}

std::optional<Format> detect_format(std::string_view bytes, std::string_view path) {
  if (const auto format = format_by_content(bytes)) return format;
  if (const auto format = format_by_extension(path)) return format;
  if (starts_with_row_of_numbers(bytes)) return Format::text;
  return std::nullopt;
}

Points parse_cloud(std::string_view bytes, std::string_view path) {
  if (bytes.empty()) fail("a point cloud", "an empty file");
  const std::optional<Format> format = detect_format(bytes, path);
  if (!format) {
    fail("a point cloud as " + std::string(known_formats),
         "a file that begins " + quoted(bytes.substr(0, 16)));
  }
  return parse_cloud_as(*format, bytes);
}

Points parse_cloud_as(Format format, std::string_view bytes) {
  switch (format) {
    case Format::ply:
      return read_ply(bytes);
    case Format::pcd:
      return read_pcd(bytes);
    case Format::obj:
      return read_obj(bytes);
    case Format::off:
      return read_off(bytes);
    case Format::npy:
      return read_npy(bytes);
    case Format::text:
      break;
  }
  return read_text(bytes);
}

Points read_cloud(const std::string& path) {
  try {
    return parse_cloud(read_bytes(path), path);
  } catch (const CloudFileError& error) {
    throw CloudFileError(one_line(path) + ": " + error.what());
  }
}

}  // namespace vnreg::cloud_file
