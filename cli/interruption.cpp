#include "interruption.hpp"

#include <csignal>

namespace vnreg::cli {
namespace {

std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler writes it");

void remember(int) { interrupted = true; }

void set_handler(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  ::sigaction(signal, &action, nullptr);
}

}  // namespace

Interruption::Interruption() {
  interrupted = false;
  set_handler(SIGINT, remember);
  set_handler(SIGTERM, remember);
  std::signal(SIGXFSZ, SIG_IGN);
}

Interruption::~Interruption() {
  for (const int signal : {SIGINT, SIGTERM, SIGXFSZ}) std::signal(signal, SIG_DFL);
}

const std::atomic<bool>& Interruption::flag() const noexcept { return interrupted; }

}  // namespace vnreg::cli
