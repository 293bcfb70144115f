// The file that a batch writes its rows to, so that a killed run loses none of them.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace vnreg::cli {

/// An open file of lines, to which whole lines are added at its end. Locked: no second process can
/// have it open. A process that dies between any two instructions leaves all lines that were added
/// before, and at most a part of one more.
class RowJournal {
 public:
  /// Opens or makes the file and locks it. Throws CommandError: it cannot be written, it is no
  /// regular file, another process has it.
  explicit RowJournal(const std::string& path);
  ~RowJournal();
  RowJournal(const RowJournal&) = delete;
  RowJournal& operator=(const RowJournal&) = delete;

  const std::string& path() const noexcept { return path_; }

  /// True if there is nothing in the file.
  bool empty() const;

  /// Visits the whole lines of the file, without their ends; returns the bytes up to the last.
  std::size_t for_each_line(const std::function<void(std::string_view)>& visit) const;

  /// Cuts the file off after `size` bytes: of a line that was not finished, or, with 0, of all.
  void truncate(std::size_t size);

  /// Adds lines, each with its end. They survive this process at once, and a power cut after a
  /// second at most. Throws CommandError when there is no room; what was added of them is taken
  /// back as far as that goes.
  void add(std::string_view lines);

  /// Waits until the disk has all that was added.
  void sync();

 private:
  [[noreturn]] void fail_with(std::string_view expected) const;

  std::string path_;
  int descriptor_ = -1;
  std::size_t size_ = 0;  // of the whole lines
  std::chrono::steady_clock::time_point last_sync_ = std::chrono::steady_clock::now();
};

}  // namespace vnreg::cli
