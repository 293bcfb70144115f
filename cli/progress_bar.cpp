#include "progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <string>

#include "command.hpp"
#include "terminal.hpp"

namespace vnreg::cli {
namespace {

constexpr std::chrono::milliseconds between_drawings{100};
constexpr std::string_view erase_line = "\r\x1b[K";

/// Hours, minutes and seconds, such as 0:02:05.
std::string duration_text(double seconds) {
  const auto whole = static_cast<long>(std::clamp(seconds, 0.0, 3.6e8));
  const auto two_digits = [](long n) {
    return std::string{static_cast<char>('0' + n / 10), static_cast<char>('0' + n % 10)};
  };
  return std::to_string(whole / 3600) + ':' + two_digits(whole / 60 % 60) + ':' +
         two_digits(whole % 60);
}

std::string bar_text(std::size_t done, std::size_t total, int width) {
  const auto cells = static_cast<std::size_t>(width);
  const std::size_t full = total == 0 ? cells : cells * done / total;
  return std::string("[").append(full, '#').append(cells - full, '.').append("]");
}

}  // namespace

ProgressBar::ProgressBar(std::size_t done, std::size_t total, bool quiet)
    : done_before_(done), total_(total), visible_(!quiet && is_terminal(STDERR_FILENO)) {}

ProgressBar::~ProgressBar() {
  if (visible_) std::cerr << erase_line << std::flush;
}

void ProgressBar::update(std::size_t done) {
  if (!visible_) return;
  const Clock::time_point now = Clock::now();
  if (now < next_drawing_) return;
  next_drawing_ = now + between_drawings;
  draw(done, now);
}

void ProgressBar::draw(std::size_t done, Clock::time_point now) const {
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  const double rate = seconds > 0 ? static_cast<double>(done - done_before_) / seconds : 0;
  std::string text = ' ' + std::to_string(done) + " of " + std::to_string(total_);
  if (rate > 0) {
    text += ", " + number_text(rate, 3) + " a second, " +
            duration_text(static_cast<double>(total_ - done) / rate) + " left";
  }
  const int room = terminal_width(STDERR_FILENO) - 3 - static_cast<int>(text.size());
  if (room >= 8) text = bar_text(done, total_, std::min(room, 40)) + text;
  std::cerr << erase_line << text << std::flush;
}

}  // namespace vnreg::cli
