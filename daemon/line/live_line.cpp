// SPDX-License-Identifier: MIT
#include "daemon/line/live_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <utility>

#include "base/host_time.hpp"
#include "daemon/awaiting.hpp"
#include "drivers/transport/device_users.hpp"

namespace prism::line {
namespace {

namespace asio = boost::asio;
using daemon::kUse;
using pipeline::LineState, pipeline::Severity;

auto as_steady(std::chrono::duration<double> seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(seconds);
}

}  // namespace

LiveLine::LiveLine(asio::io_context& io, pipeline::Acquisition& acquisition, std::size_t number, ArrivalClock& clock,
                   bool alone, pipeline::Tell tell)
    : io_(io),
      acquisition_(acquisition),
      number_(number),
      tell_(std::move(tell)),
      watch_timer_(io),
      pause_timer_(io),
      arrival_(clock),
      alone_(alone),
      last_progress_(Clock::now()) {}

void LiveLine::start() {
  asio::co_spawn(io_, watch(), asio::detached);
  retry_ = std::chrono::duration<double>(config().retry_min_s);
  open_or_pause();
}

void LiveLine::stop() {
  stopping_ = true;
  open_.reset();
  watch_timer_.cancel();
  pause_timer_.cancel();
}

void LiveLine::reopen() {
  pause_timer_.cancel();
  open_.reset();
  open_or_pause();
}

void LiveLine::open_or_pause() {
  if (!open()) pause();
}

bool LiveLine::open() {
  auto opened = transport::open(settings());
  if (!opened) {
    const std::string& why = opened.error().text();
    set(LineState::kConnecting, why);
    complain("line_absent", why + "; retrying");
    return false;
  }
  open_.emplace(io_, std::move(*opened));
  ++opening_;
  begun_ = false;
  if (alone_) arrival_.begin();
  last_data_ = last_progress_ = Clock::now();
  status().notes = open_->transport->notes();
  status().hardware.reset();
  listen();
  if (complaint_kind_ == "line_silent") return true;  // logged once, even if the line is reopened
  set(LineState::kConnecting, "open, no data yet");
  tell(Severity::kInfo, "line_open", transport::describe(settings()) + ": open");
  for (const std::string& note : status().notes) tell(Severity::kInfo, "line_note", note);
  return true;
}

// A sensor line's texts begin with its name.
void LiveLine::tell(Severity severity, const char* kind, const std::string& text) {
  const bool gyro = number_ == pipeline::kGyroLine;
  tell_(severity, kind, gyro ? text : acquisition_.setup().sensor_lines[number_ - 1].name + ": " + text);
}

void LiveLine::set(LineState state, const std::string& detail) { status().set(state, detail, host_time_ns()); }

// Logs a fault once; again only if it changes, or after data arrived.
void LiveLine::complain(const char* kind, const std::string& text) {
  if (text == complaint_) return;
  complaint_ = text;
  complaint_kind_ = kind;
  tell(Severity::kWarning, kind, text);
}

// Asio only waits until the line is readable. read(2) is called directly, which saves Asio's reads before and after.
void LiveLine::listen() {
  open_->ready.async_wait(asio::posix::stream_descriptor::wait_read,
                          [this, opening = opening_](boost::system::error_code error) {
                            if (!error && open_ && opening == opening_) readable();
                          });
}

void LiveLine::readable() {
  using Kind = transport::Received::Kind;
  const transport::Received received = open_->transport->read(buffer_);
  if (received.kind == Kind::kLost) {
    set(LineState::kConnecting, received.why);
    return lose("line_lost", "lost: " + received.why);
  }
  if (received.kind == Kind::kEmpty) return rest();
  if (received.kind == Kind::kData) {
    last_data_ = last_progress_ = Clock::now();
    const std::int64_t arrival_ns = arrival_.stamp(last_data_);
    if (!begun_) begin_receiving(arrival_ns);
    acquisition_.feed(number_, {buffer_.data(), received.bytes}, arrival_ns);
  }
  listen();
}

void LiveLine::begin_receiving(std::int64_t arrival_ns) {
  begun_ = true;
  acquisition_.begin_session(number_, arrival_ns);
  set(LineState::kReceiving);
  tell(Severity::kInfo, "line_receiving", transport::describe(settings()) + ": receiving");
  retry_ = std::chrono::duration<double>(config().retry_min_s);
  complaint_.clear();
  complaint_kind_.clear();
}

void LiveLine::lose(const char* kind, const std::string& why) {
  complain(kind, transport::describe(settings()) + ": " + why + "; opening it again until data comes");
  open_.reset();
  acquisition_.finish(number_);
  pause();
}

// Reports new hardware errors as an event.
void LiveLine::count_hardware() {
  const auto counters = open_->transport->counters();
  std::optional<transport::LineCounters>& before = status().hardware;
  if (counters && before && counters->errors() > before->errors()) {
    tell(Severity::kWarning, "line_errors",
         "the serial hardware reports errors on the line; prismctl line counts them");
  }
  before = counters;
}

// Wakes at most once a second, not per read: checks for missing data, expires frame candidates, reads hardware
// counters.
asio::awaitable<void> LiveLine::watch() {
  while (!stopping_) {
    const auto silence = as_steady(std::chrono::duration<double>(config().silence_s));
    const auto due = open_ ? last_data_ + silence : Clock::now() + silence;
    const auto next =
        std::clamp(due, Clock::now() + std::chrono::milliseconds(10), Clock::now() + std::chrono::seconds(1));
    watch_timer_.expires_at(next);
    co_await watch_timer_.async_wait(kUse);
    if (stopping_ || !open_) continue;
    acquisition_.expire(number_, arrival_.now_ns());
    count_hardware();
    // Unread bytes: the line has data, but this process did not run (stopped, swapped out, no CPU time).
    if (Clock::now() - last_data_ < silence || open_->transport->has_unread()) continue;
    std::string why = fmt::format("no data for {} s", config().silence_s);
    if (const std::string others = transport::other_users_of(settings().device); !others.empty())
      why += fmt::format("; another program may be reading this device: {}", others);
    set(LineState::kSilent, why);
    lose("line_silent", why);
  }
}

// A line can be readable without data: without this pause it would be read in a busy loop.
void LiveLine::rest() {
  pause_timer_.expires_after(std::chrono::milliseconds(20));
  pause_timer_.async_wait([this, opening = opening_](boost::system::error_code error) {
    if (!error && open_ && opening == opening_) listen();
  });
}

// A missing device is checked every retry_min_s, so that it is used soon after it is back. For a device that exists but
// fails, the pause doubles.
void LiveLine::pause() {
  const bool there = transport::is_present(settings());
  if (!there) retry_ = std::chrono::duration<double>(config().retry_min_s);
  last_progress_ = Clock::now() + as_steady(retry_);
  pause_timer_.expires_after(as_steady(retry_));
  pause_timer_.async_wait([this](boost::system::error_code error) {
    if (!error && !stopping_ && !open_) open_or_pause();
  });
  if (there) retry_ = std::min(retry_ * 2, std::chrono::duration<double>(config().retry_max_s));
}

}  // namespace prism::line
