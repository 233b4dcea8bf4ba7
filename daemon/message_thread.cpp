// SPDX-License-Identifier: MIT
#include "daemon/message_thread.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>
#include <thread>
#include <utility>

namespace prism::daemon {
namespace {

// Ignores a closed reader. Waits if a non-blocking descriptor is full.
void write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written > 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (written < 0 && errno == EAGAIN) {
      pollfd wait{descriptor, POLLOUT, 0};
      ::poll(&wait, 1, -1);
    } else if (written < 0 && errno != EINTR) {
      return;
    }
  }
}

}  // namespace

MessageThread::MessageThread(int descriptor) {
  sigset_t all, before;  // other threads handle the signals
  sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread([state = state_, descriptor] { run(state, descriptor); }).detach();
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

MessageThread::~MessageThread() {
  const std::lock_guard lock(state_->mutex);
  state_->stop = true;
  state_->work.notify_one();
}

void MessageThread::put(std::string line) {
  const std::lock_guard lock(state_->mutex);
  if (state_->lines.size() >= kLines) {
    ++state_->lost;
    ++state_->lost_total;
    return;
  }
  state_->lines.push_back(std::move(line));
  state_->work.notify_one();
}

bool MessageThread::finish(std::chrono::milliseconds timeout) {
  std::unique_lock lock(state_->mutex);
  return state_->idle.wait_for(lock, timeout, [this] { return state_->lines.empty() && !state_->busy; });
}

std::uint64_t MessageThread::lost() const {
  const std::lock_guard lock(state_->mutex);
  return state_->lost_total;
}

void MessageThread::run(const std::shared_ptr<State>& state, int descriptor) {
  std::unique_lock lock(state->mutex);
  for (;;) {
    state->work.wait(lock, [&] { return state->stop || !state->lines.empty(); });
    if (state->lines.empty()) return;
    std::string text = std::move(state->lines.front());
    state->lines.pop_front();
    if (const std::uint64_t lost = std::exchange(state->lost, 0); lost > 0)
      text.insert(0, fmt::format("prismd: lost {} messages: stderr was blocked\n", lost));
    state->busy = true;
    lock.unlock();
    write_all(descriptor, text);
    lock.lock();
    state->busy = false;
    if (state->lines.empty()) state->idle.notify_all();
  }
}

}  // namespace prism::daemon
