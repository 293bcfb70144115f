#include <fcntl.h>
#include <sys/mman.h>
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

const std::byte* map_all(const std::string& path, int descriptor, std::size_t size) {
  if (size == 0) return nullptr;  // nothing to map; mmap would refuse it
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, descriptor, 0);
  if (address == MAP_FAILED) refuse(path, "a file that can be mapped", reason(errno));
  return static_cast<const std::byte*>(address);
}

}  // namespace

FileBytes FileBytes::open(const std::string& path, Access access) {
  if (path.find('\0') != std::string::npos) {
    refuse(path.substr(0, path.find('\0')), "a path without zero bytes", "one with a zero byte");
  }
  const Descriptor descriptor(path);
  const std::size_t size = checked_size(path, descriptor.value());
  if (access == Access::read) return FileBytes(read_all(path, descriptor.value(), size));
  return FileBytes(Mapping(map_all(path, descriptor.value(), size), Unmap{size}));
}

void FileBytes::Unmap::operator()(const std::byte* data) const noexcept {
  ::munmap(const_cast<std::byte*>(data), size);
}

std::span<const std::byte> FileBytes::span() const noexcept {
  if (const auto* copy = std::get_if<AlignedBytes>(&bytes_)) return copy->span();
  const auto& mapping = *std::get_if<Mapping>(&bytes_);
  return {mapping.get(), mapping ? mapping.get_deleter().size : 0};
}

}  // namespace vnreg::model_format
