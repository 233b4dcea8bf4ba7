// SPDX-License-Identifier: MIT
#include "daemon/live_line.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cstring>
#include <utility>

namespace prism::daemon {
namespace {

namespace asio = boost::asio;
constexpr auto kUse = asio::as_tuple(asio::use_awaitable);

auto as_steady(std::chrono::duration<double> seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(seconds);
}

}  // namespace

LiveLine::LiveLine(asio::io_context& io, Station& station)
    : io_(io), station_(station), watch_timer_(io), pause_timer_(io), last_progress_(Clock::now()) {}

void LiveLine::start() {
  asio::co_spawn(io_, watch(), asio::detached);
  retry_ = std::chrono::duration<double>(station_.setup().config.line.retry_min_s);
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
  resting_ = false;
  open_or_pause();
}

void LiveLine::open_or_pause() {
  if (!open()) pause();
}

bool LiveLine::open() {
  Result<drivers::SerialLine> line = drivers::open_serial_line(station_.setup().line);
  if (!line) {
    const std::string& why = line.error().text();
    station_.set_state(LineState::kConnecting, why);
    complain("line_absent", why + "; trying again until it is there");
    return false;
  }
  line_ = std::move(*line);
  line_->block();
  begun_ = false;
  arrival_.begin();
  last_data_ = last_progress_ = Clock::now();
  station_.line_notes(line_->notes());
  station_.line_hardware(std::nullopt);
  if (complaint_kind_ == "line_silent") return true;  // one silence, one line, however often the line is opened in it
  station_.set_state(LineState::kConnecting, "open, no data yet");
  station_.tell(Severity::kInfo, "line_open", station_.setup().config.line.device + ": open");
  for (const std::string& note : line_->notes()) station_.tell(Severity::kInfo, "line_note", note);
  return true;
}

// One fault, one line: said again only when it is another one, or after data came in between.
void LiveLine::complain(const char* kind, const std::string& text) {
  if (text == complaint_) return;
  complaint_ = text;
  complaint_kind_ = kind;
  station_.tell(Severity::kWarning, kind, text);
}

[[gnu::hot]] ssize_t LiveLine::read() { return ::read(line_->fd(), buffer_.data(), buffer_.size()); }

[[gnu::hot]] void LiveLine::received(ssize_t size, int error) {
  if (size > 0) {
    last_data_ = last_progress_ = steady_now();
    const std::int64_t arrival_ns = arrival_.at(last_data_);
    if (!begun_) begin_receiving(arrival_ns);
    station_.feed({buffer_.data(), static_cast<std::size_t>(size)}, arrival_ns);
    return;
  }
  // A pty and some drivers say "end of file" for an empty read; only a line that is really gone ends the session.
  if (size == 0 && !drivers::line_is_gone(line_->fd())) return rest();
  const std::string why = size == 0 ? "unplugged (end of file)" : std::strerror(error);
  station_.set_state(LineState::kConnecting, why);
  lose("line_lost", "lost: " + why);
}

void LiveLine::begin_receiving(std::int64_t arrival_ns) {
  begun_ = true;
  station_.begin_session(arrival_ns);
  station_.set_state(LineState::kReceiving);
  station_.tell(Severity::kInfo, "line_receiving", station_.setup().config.line.device + ": receiving");
  retry_ = std::chrono::duration<double>(station_.setup().config.line.retry_min_s);
  complaint_.clear();
  complaint_kind_.clear();
}

void LiveLine::lose(const char* kind, const std::string& why) {
  complain(kind, station_.setup().config.line.device + ": " + why + "; opening it again until data comes");
  line_.reset();
  station_.finish();
  pause();
}

// One wake-up a second at most, not one per read: silence, waiting candidates, and a host clock that was set.
asio::awaitable<void> LiveLine::watch() {
  while (!stopping_) {
    const auto silence = as_steady(std::chrono::duration<double>(station_.setup().config.line.silence_s));
    const auto due = line_ ? last_data_ + silence : Clock::now() + silence;
    const auto next = std::clamp(due, Clock::now() + std::chrono::milliseconds(10),
                                 Clock::now() + std::chrono::seconds(1));
    watch_timer_.expires_at(next);
    co_await watch_timer_.async_wait(kUse);
    if (stopping_ || !line_) continue;
    station_.expire(arrival_.now_ns());
    station_.line_hardware(drivers::read_line_counters(line_->fd()));
    if (const std::int64_t step = arrival_.check()) {
      station_.tell(
          Severity::kWarning, "host_clock",
          fmt::format("the host clock was set by {:+.3f} s; the window begins anew", static_cast<double>(step) * 1e-9));
      station_.begin_session(arrival_.now_ns());
    }
    if (Clock::now() - last_data_ < silence) continue;
    const std::string why = fmt::format("no data for {} s", station_.setup().config.line.silence_s);
    station_.set_state(LineState::kSilent, why);
    lose("line_silent", why);
  }
}

// An idle line that is readable all the same would be read without end.
void LiveLine::rest() {
  resting_ = true;
  pause_timer_.expires_after(std::chrono::milliseconds(20));
  pause_timer_.async_wait([this](boost::system::error_code error) {
    if (!error) resting_ = false;
  });
}

void LiveLine::pause() {
  last_progress_ = Clock::now() + as_steady(retry_);
  resting_ = false;
  pause_timer_.expires_after(as_steady(retry_));
  pause_timer_.async_wait([this](boost::system::error_code error) {
    if (!error && !stopping_ && !line_) open_or_pause();
  });
  retry_ = std::min(retry_ * 2, std::chrono::duration<double>(station_.setup().config.line.retry_max_s));
}

}  // namespace prism::daemon
