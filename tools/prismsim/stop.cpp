// SPDX-License-Identifier: MIT
#include "tools/prismsim/stop.hpp"

#include <csignal>
#include <initializer_list>

namespace prism::prismsim {
namespace {

volatile std::sig_atomic_t g_stop = 0;

}  // namespace

void catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = 1; };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::sigaction(signal, &action, nullptr);
}

bool stop_requested() { return g_stop != 0; }

}  // namespace prism::prismsim
