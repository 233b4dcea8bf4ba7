// SPDX-License-Identifier: MIT
#include "daemon/logging.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <thread>
#include <utility>

#include "base/escape.hpp"
#include "base/host_time.hpp"
#include "base/text_number.hpp"

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

namespace {

struct Log {
  Severity least;
  const bool to_journal = std::getenv("JOURNAL_STREAM") != nullptr;
  MessageThread messages{STDERR_FILENO};
};
std::unique_ptr<Log> log_of_process;

}  // namespace

void begin_logging(const std::string& level) {
  Severity least = Severity::kDebug;
  while (least < Severity::kError && level != socket::severity_name(least))
    least = Severity(static_cast<int>(least) + 1);
  log_of_process = std::make_unique<Log>(least);
}

void finish_logging() {
  if (log_of_process) log_of_process->messages.finish(std::chrono::milliseconds(500));
}

void log_line(Severity severity, std::string_view text) {
  if (!log_of_process || severity < log_of_process->least) return;
  constexpr std::array kPriorities = {"<7>", "<6>", "<4>", "<3>"};  // of syslog, which the journal reads
  constexpr std::size_t kToMilliseconds = 23;
  const std::string head =
      log_of_process->to_journal
          ? kPriorities[static_cast<std::size_t>(severity)]
          : fmt::format("{}Z prismd: {}: ", utc_nano_text(host_time_ns()).substr(0, kToMilliseconds),
                        socket::severity_name(severity));
  log_of_process->messages.put(head + printable(text) + "\n");
}

void log_event(const socket::Event& event) {
  const std::string more =
      event.repeats > 0 ? fmt::format(" ({} more times since the last message)", event.repeats) : std::string();
  log_line(event.severity, event.text + more);
}

}  // namespace prism::daemon
