#include "batch/part_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "cloud_file/whole_file.hpp"
#include "command.hpp"

namespace vnreg::cli {

PartFile::PartFile(const std::string& path) : path_(path), part_(path + ".part") {
  descriptor_ = ::open(part_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail_with("a file that can be written to");
}

PartFile::~PartFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(part_.c_str());
}

void PartFile::fail_with(std::string_view expected) const {
  const std::string found = std::strerror(errno);
  throw CommandError(ExitCode::failure,
                     path_ + ": expected " + std::string(expected) + ", found " + found);
}

void PartFile::write(std::string_view bytes) {
  if (!cloud_file::write_fully(descriptor_, bytes)) fail_with("room for the file");
}

void PartFile::finish() {
  if (::fsync(descriptor_) != 0 && errno != EINVAL) fail_with("room for the file");
  if (std::rename(part_.c_str(), path_.c_str()) != 0) fail_with("a name that can be written to");
  ::close(descriptor_);
  descriptor_ = -1;
}

}  // namespace vnreg::cli
