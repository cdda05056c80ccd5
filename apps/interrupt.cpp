#include "apps/interrupt.h"

#include <csignal>

namespace clothfit {
namespace {

// A signal handler can reach nothing but a global.
volatile std::sig_atomic_t interrupt_flag = 0;

extern "C" void on_interrupt(int signal_number) {
  interrupt_flag = 1;
  std::signal(signal_number, SIG_DFL);
}

}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
}

bool interrupted() {
  return interrupt_flag != 0;
}

}  // namespace clothfit
