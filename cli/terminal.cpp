#include "terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>

namespace vnreg::cli {
namespace {

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

std::string_view escape_code(Colour colour) {
  switch (colour) {
    case Colour::green:
      return "\x1b[32m";
    case Colour::yellow:
      return "\x1b[33m";
    case Colour::red:
      break;
  }
  return "\x1b[31m";
}

}  // namespace

bool is_terminal(int descriptor) {
  return ::isatty(descriptor) == 1 && environment("TERM") != "dumb";
}

int terminal_width(int descriptor) {
  winsize size{};
  const bool known = ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

std::string coloured(std::string_view text, Colour colour, int descriptor) {
  if (!is_terminal(descriptor) || !environment("NO_COLOR").empty()) return std::string(text);
  return std::string(escape_code(colour)) + std::string(text) + "\x1b[0m";
}

}  // namespace vnreg::cli
