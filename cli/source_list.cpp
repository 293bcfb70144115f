#include "source_list.hpp"

#include <glob.h>

#include <algorithm>
#include <filesystem>

#include "cloud_file/cloud_file.hpp"
#include "command.hpp"

namespace vnreg::cli {
namespace {

namespace fs = std::filesystem;

bool is_folder(const std::string& name) {
  std::error_code ignored;
  return fs::is_directory(name, ignored);
}

bool is_pattern(const std::string& name) {
  std::error_code ignored;
  return name.find_first_of("*?[") != std::string::npos && !fs::exists(name, ignored);
}

bool is_cloud(const fs::directory_entry& entry) {
  const std::string extension = entry.path().extension().string();
  std::error_code ignored;
  return !extension.empty() && !entry.is_directory(ignored) &&
         cloud_file::format_of_extension(std::string_view(extension).substr(1)).has_value();
}

std::vector<std::string> clouds_in(const std::string& folder) {
  std::vector<std::string> names;
  try {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      if (is_cloud(entry)) names.push_back(entry.path().string());
    }
  } catch (const fs::filesystem_error& error) {
    throw CommandError(ExitCode::input, folder + ": expected a folder that can be read, found " +
                                            error.code().message());
  }
  std::ranges::sort(names);
  return names;
}

std::vector<std::string> matches_of(const std::string& pattern) {
  glob_t found{};
  std::vector<std::string> names;
  if (::glob(pattern.c_str(), 0, nullptr, &found) == 0) {
    names.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  }
  ::globfree(&found);
  std::ranges::sort(names);
  return names;
}

}  // namespace

bool is_many(const std::vector<std::string>& sources) {
  return sources.size() > 1 || is_folder(sources.front()) || is_pattern(sources.front());
}

std::vector<std::string> list_sources(const std::vector<std::string>& sources) {
  std::vector<std::string> files;
  for (const std::string& source : sources) {
    std::vector<std::string> found{source};
    if (is_folder(source)) found = clouds_in(source);
    if (is_pattern(source)) found = matches_of(source);
    if (found.empty()) {
      throw CommandError(ExitCode::input, source + ": expected files of point clouds as " +
                                              std::string(cloud_file::known_formats) +
                                              ", found none");
    }
    files.insert(files.end(), found.begin(), found.end());
  }
  return files;
}

}  // namespace vnreg::cli
