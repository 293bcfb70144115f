#include "cloud_file/whole_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "cloud_file/cloud_file_error.hpp"

namespace vnreg::cloud_file {
namespace {

/// A new file beside its destination; removed again unless it is renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& destination) : path_(destination + ".XXXXXX") {
    descriptor_ = ::mkstemp(path_.data());
    if (descriptor_ < 0) fail_with("a folder that can be written to");
  }
  ~TemporaryFile() {
    close_file();
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::string_view bytes) {
    if (!write_fully(descriptor_, bytes)) fail_with("room for the file");
  }

  void rename_to(const std::string& destination) {
    // mkstemp makes the file private; give it the rights that any new file of the user gets.
    const mode_t mask = ::umask(0);
    ::umask(mask);
    if (::fchmod(descriptor_, 0666 & ~mask) != 0 || ::fsync(descriptor_) != 0 || !close_file()) {
      fail_with("room for the file");
    }
    if (::rename(path_.c_str(), destination.c_str()) != 0)
      fail_with("a name that can be written to");
    path_.clear();
  }

 private:
  [[noreturn]] static void fail_with(std::string_view expected) {
    fail(expected, std::strerror(errno));
  }

  bool close_file() {
    if (descriptor_ < 0) return true;
    const bool closed = ::close(descriptor_) == 0;
    descriptor_ = -1;
    return closed;
  }

  std::string path_;
  int descriptor_ = -1;
};

/// Where the file goes: a link is followed, so that it stays a link; only files are replaced.
std::string resolve(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return path;
  if (!std::filesystem::is_regular_file(status))
    fail("a file to write", "something else of that name");
  const std::filesystem::path target = std::filesystem::canonical(path, error);
  return error ? path : target.string();
}

}  // namespace

bool write_fully(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

void write_whole_file(const std::string& path, std::initializer_list<std::string_view> parts) {
  try {
    const std::string destination = resolve(path);
    TemporaryFile file(destination);
    for (const std::string_view part : parts) file.write(part);
    file.rename_to(destination);
  } catch (const CloudFileError& error) {
    throw CloudFileError(one_line(path) + ": " + error.what());
  }
}

}  // namespace vnreg::cloud_file
