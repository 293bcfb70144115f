#include "batch/row_journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "cloud_file/whole_file.hpp"
#include "command.hpp"

namespace vnreg::cli {
namespace {

constexpr std::chrono::seconds between_syncs{1};

}  // namespace

RowJournal::RowJournal(const std::string& path) : path_(path) {
  struct stat status {};
  const bool exists = ::stat(path.c_str(), &status) == 0;
  if (exists && !S_ISREG(status.st_mode)) {
    throw CommandError(ExitCode::failure,
                       path + ": expected a regular file, found something else of that name");
  }
  descriptor_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail_with("a file that can be written to");
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    const bool taken = errno == EWOULDBLOCK;
    const std::string found = taken ? "another run that writes it" : std::strerror(errno);
    ::close(descriptor_);
    throw CommandError(ExitCode::failure, path + ": expected to write it alone, found " + found);
  }
}

RowJournal::~RowJournal() { ::close(descriptor_); }

void RowJournal::fail_with(std::string_view expected) const {
  const std::string found = std::strerror(errno);
  throw CommandError(ExitCode::failure,
                     path_ + ": expected " + std::string(expected) + ", found " + found);
}

bool RowJournal::empty() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail_with("a file that can be read");
  return status.st_size == 0;
}

std::size_t RowJournal::for_each_line(const std::function<void(std::string_view)>& visit) const {
  std::string rest;  // of the pieces read so far, what follows the last line end
  std::string piece(std::size_t{1} << 16U, '\0');
  std::size_t end = 0;
  off_t offset = 0;
  for (;;) {
    const ssize_t got = ::pread(descriptor_, piece.data(), piece.size(), offset);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail_with("a file that can be read");
    if (got == 0) return end;
    offset += got;
    const std::size_t searched = rest.size();  // a line may be as long as the file
    rest.append(piece, 0, static_cast<std::size_t>(got));
    std::string_view lines = rest;
    for (std::size_t size = lines.find('\n', searched); size != lines.npos;
         size = lines.find('\n')) {
      visit(lines.substr(0, size));
      lines.remove_prefix(size + 1);
      end += size + 1;
    }
    rest.erase(0, rest.size() - lines.size());
  }
}

void RowJournal::truncate(std::size_t size) {
  const auto offset = static_cast<off_t>(size);
  if (::ftruncate(descriptor_, offset) != 0 || ::lseek(descriptor_, offset, SEEK_SET) < 0) {
    fail_with("a file that can be written to");
  }
  size_ = size;
}

void RowJournal::add(std::string_view lines) {
  if (!cloud_file::write_fully(descriptor_, lines)) {
    const int error = errno;
    // Whoever reads the file meets whole rows only; if even this fails, the next run does it.
    [[maybe_unused]] const int ignored = ::ftruncate(descriptor_, static_cast<off_t>(size_));
    errno = error;
    fail_with("room for the rows");
  }
  size_ += lines.size();
  if (std::chrono::steady_clock::now() - last_sync_ >= between_syncs) sync();
}

void RowJournal::sync() {
  // Some file systems do not know fsync; what they keep, they keep.
  if (::fsync(descriptor_) != 0 && errno != EINVAL) fail_with("room for the rows");
  last_sync_ = std::chrono::steady_clock::now();
}

}  // namespace vnreg::cli
