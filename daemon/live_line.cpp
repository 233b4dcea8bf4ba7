// SPDX-License-Identifier: MIT
#include "daemon/live_line.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <cerrno>
#include <cstring>
#include <utility>

#include "daemon/awaiting.hpp"
namespace prism::daemon {
namespace {

namespace asio = boost::asio;

auto as_steady(std::chrono::duration<double> seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(seconds);
}

// The line spoke while this process was held up (stopped, swapped, starved): that is no silence.
bool bytes_wait(int fd) {
  int bytes = 0;
  return ::ioctl(fd, FIONREAD, &bytes) == 0 && bytes > 0;
}

}  // namespace

LiveLine::LiveLine(asio::io_context& io, Instance& instance, LinePort& port, ArrivalClock& clock, bool alone)
    : io_(io),
      instance_(instance),
      port_(port),
      watch_timer_(io),
      pause_timer_(io),
      arrival_(clock),
      alone_(alone),
      last_progress_(Clock::now()) {}

void LiveLine::start() {
  asio::co_spawn(io_, watch(), asio::detached);
  retry_ = std::chrono::duration<double>(port_.config().retry_min_s);
  open_or_pause();
}

void LiveLine::stop() {
  stopping_ = true;
  line_.reset();
  watch_timer_.cancel();
  pause_timer_.cancel();
}

void LiveLine::reopen() {
  pause_timer_.cancel();
  line_.reset();
  open_or_pause();
}

void LiveLine::open_or_pause() {
  if (!open()) pause();
}

bool LiveLine::open() {
  Result<drivers::SerialLine> line = drivers::open_serial_line(port_.settings());
  if (!line) {
    const std::string& why = line.error().text();
    set(LineState::kConnecting, why);
    complain("line_absent", why + "; trying again until it is there");
    return false;
  }
  const std::vector<std::string> notes = line->notes();
  line_.emplace(io_, line->release());
  ++opening_;
  begun_ = false;
  if (alone_) arrival_.begin();
  last_data_ = last_progress_ = Clock::now();
  port_.status().notes = notes;
  port_.status().hardware.reset();
  listen();
  if (complaint_kind_ == "line_silent") return true;  // one silence, one line, however often the line is opened in it
  set(LineState::kConnecting, "open, no data yet");
  tell(Severity::kInfo, "line_open", port_.config().device + ": open");
  for (const std::string& note : notes) tell(Severity::kInfo, "line_note", note);
  return true;
}

void LiveLine::tell(Severity severity, const char* kind, const std::string& text) {
  instance_.tell(severity, kind, port_.prefix() + text);
}

void LiveLine::set(LineState state, const std::string& detail) { port_.status().set(state, detail, host_time_ns()); }

// One fault, one line: said again only when it is another one, or after data came in between.
void LiveLine::complain(const char* kind, const std::string& text) {
  if (text == complaint_) return;
  complaint_ = text;
  complaint_kind_ = kind;
  tell(Severity::kWarning, kind, text);
}

// Asio says when there is something to read; read(2) itself finds it at once, without Asio's try before and after.
void LiveLine::listen() {
  line_->async_wait(asio::posix::stream_descriptor::wait_read,
                    [this, opening = opening_](boost::system::error_code error) {
                      if (!error && line_ && opening == opening_) readable();
                    });
}

void LiveLine::readable() {
  const int fd = line_->native_handle();
  const ssize_t size = ::read(fd, buffer_.data(), buffer_.size());
  if (size > 0) {
    last_data_ = last_progress_ = Clock::now();
    const std::int64_t arrival_ns = arrival_.stamp(last_data_);
    if (!begun_) begin_receiving(arrival_ns);
    port_.feed({buffer_.data(), static_cast<std::size_t>(size)}, arrival_ns);
    return listen();
  }
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return listen();
  // A pty and some drivers say "end of file" for an empty read; only a line that is really gone ends the session.
  if (size == 0 && !drivers::line_is_gone(fd)) return rest();
  const std::string why = size == 0 ? "unplugged (end of file)" : std::strerror(errno);
  set(LineState::kConnecting, why);
  lose("line_lost", "lost: " + why);
}

void LiveLine::begin_receiving(std::int64_t arrival_ns) {
  begun_ = true;
  port_.begin_session(arrival_ns);
  set(LineState::kReceiving);
  tell(Severity::kInfo, "line_receiving", port_.config().device + ": receiving");
  retry_ = std::chrono::duration<double>(port_.config().retry_min_s);
  complaint_.clear();
  complaint_kind_.clear();
}

void LiveLine::lose(const char* kind, const std::string& why) {
  complain(kind, port_.config().device + ": " + why + "; opening it again until data comes");
  line_.reset();
  port_.finish();
  pause();
}

// New errors of the hardware are an event.
void LiveLine::count_hardware() {
  const auto errors = [](const drivers::LineCounters& c) {
    return c.framing_errors + c.parity_errors + c.overruns + c.breaks + c.buffer_overruns;
  };
  const auto counters = drivers::read_line_counters(line_->native_handle());
  std::optional<drivers::LineCounters>& before = port_.status().hardware;
  if (counters && before && errors(*counters) > errors(*before)) {
    tell(Severity::kWarning, "line_errors",
         "the serial hardware reports errors on the line; prismctl line counts them");
  }
  before = counters;
}

// One wake-up a second at most, not one per read: silence, candidates that wait, and a host clock that was set.
asio::awaitable<void> LiveLine::watch() {
  while (!stopping_) {
    const auto silence = as_steady(std::chrono::duration<double>(port_.config().silence_s));
    const auto due = line_ ? last_data_ + silence : Clock::now() + silence;
    const auto next =
        std::clamp(due, Clock::now() + std::chrono::milliseconds(10), Clock::now() + std::chrono::seconds(1));
    watch_timer_.expires_at(next);
    co_await watch_timer_.async_wait(kUse);
    if (stopping_ || !line_) continue;
    port_.expire(arrival_.now_ns());
    count_hardware();
    if (Clock::now() - last_data_ < silence || bytes_wait(line_->native_handle())) continue;
    const std::string why = fmt::format("no data for {} s", port_.config().silence_s);
    set(LineState::kSilent, why);
    lose("line_silent", why);
  }
}

// An idle line that is readable all the same would be read without end.
void LiveLine::rest() {
  pause_timer_.expires_after(std::chrono::milliseconds(20));
  pause_timer_.async_wait([this, opening = opening_](boost::system::error_code error) {
    if (!error && line_ && opening == opening_) listen();
  });
}

// A device that is not there costs nothing to look for, and serves the moment it is back; one that is there and fails
// is left in peace for longer and longer.
void LiveLine::pause() {
  const bool there = ::access(port_.settings().device.c_str(), F_OK) == 0;
  if (!there) retry_ = std::chrono::duration<double>(port_.config().retry_min_s);
  last_progress_ = Clock::now() + as_steady(retry_);
  pause_timer_.expires_after(as_steady(retry_));
  pause_timer_.async_wait([this](boost::system::error_code error) {
    if (!error && !stopping_ && !line_) open_or_pause();
  });
  if (there) retry_ = std::min(retry_ * 2, std::chrono::duration<double>(port_.config().retry_max_s));
}

}  // namespace prism::daemon
