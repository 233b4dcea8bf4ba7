// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/interrupt.hpp"

#include <csignal>

namespace prism::commands {
namespace {

std::atomic<bool> interrupted{false};

void interrupt(int) {
  interrupted = true;
  std::signal(SIGINT, SIG_DFL);
}

}  // namespace

const std::atomic<bool>* stop_on_interrupt() {
  std::signal(SIGINT, interrupt);
  return &interrupted;
}

}  // namespace prism::commands
