// A large file that is written piece by piece, and appears complete or not at all.
#pragma once

#include <string>
#include <string_view>

namespace vnreg::cli {

/// Writes beside the destination, PATH.part, and takes its name at the end. Only one process may
/// write a destination at a time; what a killed one left is written over.
class PartFile {
 public:
  /// Throws CommandError, as all of these do.
  explicit PartFile(const std::string& path);
  /// Removes what was not finished.
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  void write(std::string_view bytes);

  /// The file is on the disk, under its name.
  void finish();

 private:
  [[noreturn]] void fail_with(std::string_view expected) const;

  std::string path_;
  std::string part_;
  int descriptor_ = -1;
};

}  // namespace vnreg::cli
