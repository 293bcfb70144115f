#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "model_format/limits.hpp"
#include "model_format/model_file.hpp"

namespace vnreg::model_format {
namespace {

[[noreturn]] void refuse(const std::string& path, std::string expected, std::string got) {
  throw Error(ErrorCode::file_unreadable, "file \"" + path + "\"", std::move(expected),
              std::move(got));
}

std::string reason(int error_number) { return std::generic_category().message(error_number); }

class Descriptor {
 public:
  // Non-blocking, so that a named pipe is refused instead of waited for.
  explicit Descriptor(const std::string& path)
      : value_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
    if (value_ < 0) refuse(path, "a readable file", reason(errno));
  }
  ~Descriptor() { ::close(value_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int value() const noexcept { return value_; }

 private:
  int value_;
};

std::size_t checked_size(const std::string& path, int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) refuse(path, "a readable file", reason(errno));
  if (S_ISDIR(status.st_mode)) refuse(path, "a regular file", "a directory");
  if (!S_ISREG(status.st_mode)) refuse(path, "a regular file", "a pipe or a device");
  const auto size = static_cast<std::uint64_t>(status.st_size);
  if (size > max_file_bytes) {
    refuse(path, "at most " + std::to_string(max_file_bytes) + " bytes",
           std::to_string(size) + " bytes");
  }
  return static_cast<std::size_t>(size);
}

AlignedBytes read_all(const std::string& path, int descriptor, std::size_t size) {
  AlignedBytes copy(size);
  std::span<std::byte> rest = copy.span();
  while (!rest.empty()) {
    const ssize_t count = ::read(descriptor, rest.data(), rest.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuse(path, "a readable file", reason(errno));
    if (count == 0) {
      refuse(path, std::to_string(size) + " bytes",
             std::to_string(size - rest.size()) + " bytes: it shrank while it was read");
    }
    rest = rest.subspan(static_cast<std::size_t>(count));
  }
  return copy;
}

}  // namespace

AlignedBytes read_file(const std::string& path) {
  if (path.find('\0') != std::string::npos) {
    refuse(path.substr(0, path.find('\0')), "a path without zero bytes", "one with a zero byte");
  }
  const Descriptor descriptor(path);
  return read_all(path, descriptor.value(), checked_size(path, descriptor.value()));
}

}  // namespace vnreg::model_format
