// SPDX-License-Identifier: MIT
#include "daemon/reactor_watch.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <boost/system/system_error.hpp>
#include <cerrno>
#include <chrono>

namespace prism::daemon {
namespace {

constexpr std::chrono::milliseconds kAgain{1};  // a signal may come before the read that it is meant for

}  // namespace

int make_eventfd() {
  const int made = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (made < 0) throw boost::system::system_error(errno, boost::system::system_category(), "eventfd");
  return made;
}

ReactorWatch::ReactorWatch(int descriptor) : descriptor_(descriptor), quit_(make_eventfd()), reader_(::pthread_self()) {
  struct sigaction interrupts {};
  interrupts.sa_handler = [](int) {};  // no SA_RESTART: the read is to end
  ::sigaction(SIGURG, &interrupts, &before_);
  // The watching thread takes no signals: they are the others'.
  sigset_t all, old;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &old);
  thread_ = std::thread([this] { watch(); });
  ::pthread_sigmask(SIG_SETMASK, &old, nullptr);
}

ReactorWatch::~ReactorWatch() {
  {
    const std::lock_guard lock(mutex_);
    quitting_ = true;
  }
  ::eventfd_write(quit_, 1);
  answered_.notify_one();
  thread_.join();
  ::close(quit_);
  ::sigaction(SIGURG, &before_, nullptr);
}

void ReactorWatch::answer() {
  {
    const std::lock_guard lock(mutex_);
    rung_.store(false, std::memory_order_release);
  }
  answered_.notify_one();
}

void ReactorWatch::watch() {
  for (;;) {
    std::array<pollfd, 2> wait{{{descriptor_, POLLIN, 0}, {quit_, POLLIN, 0}}};
    const int ready = ::poll(wait.data(), wait.size(), -1);
    if (wait[1].revents != 0) return;
    if (ready > 0) ring();
  }
}

void ReactorWatch::ring() {
  std::unique_lock lock(mutex_);
  rung_.store(true, std::memory_order_release);
  while (rung_.load(std::memory_order_relaxed) && !quitting_) {
    if (reading_.load(std::memory_order_relaxed)) ::pthread_kill(reader_, SIGURG);
    answered_.wait_for(lock, kAgain);
  }
}

}  // namespace prism::daemon
