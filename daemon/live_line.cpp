// SPDX-License-Identifier: MIT
#include "daemon/live_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <utility>

namespace prism {
namespace {

namespace asio = boost::asio;
constexpr auto kUse = asio::as_tuple(asio::use_awaitable);

auto as_steady(std::chrono::duration<double> seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(seconds);
}

}  // namespace

LiveLine::LiveLine(asio::io_context& io, Station& station)
    : io_(io), station_(station), stream_(io), watch_timer_(io), pause_timer_(io), last_progress_(Clock::now()) {}

asio::awaitable<void> LiveLine::run() {
  asio::co_spawn(io_, watch(), asio::detached);
  retry_ = std::chrono::duration<double>(station_.setup().config.line.retry_min_s);
  while (!stopping_) {
    if (open()) co_await read_until_lost();
    if (stopping_) break;
    if (!std::exchange(reopen_, false)) co_await pause();
  }
}

void LiveLine::stop() {
  stopping_ = true;
  boost::system::error_code ignored;
  stream_.close(ignored);
  watch_timer_.cancel();
  pause_timer_.cancel();
}

void LiveLine::reopen() {
  reopen_ = true;
  boost::system::error_code ignored;
  stream_.close(ignored);
  pause_timer_.cancel();
}

bool LiveLine::open() {
  Result<SerialLine> line = open_serial_line(station_.setup().line);
  boost::system::error_code error;
  if (line) stream_.assign(line->release(), error);
  if (!line || error) {
    const std::string why = line ? station_.setup().config.line.device + ": " + error.message() : line.error().text();
    station_.set_state(LineState::kConnecting, why);
    complain("line_absent", why + "; trying again until it is there");
    return false;
  }
  begun_ = false;
  arrival_.begin();
  last_data_ = last_progress_ = Clock::now();
  station_.line_notes(line->notes());
  station_.line_hardware(std::nullopt);
  if (complaint_kind_ == "line_silent") return true;  // one silence, one line, however often the line is opened in it
  station_.set_state(LineState::kConnecting, "open, no data yet");
  station_.tell(Severity::kInfo, "line_open", station_.setup().config.line.device + ": open");
  for (const std::string& note : line->notes()) station_.tell(Severity::kInfo, "line_note", note);
  return true;
}

// One fault, one line: said again only when it is another one, or after data came in between.
void LiveLine::complain(const char* kind, const std::string& text) {
  if (text == complaint_) return;
  complaint_ = text;
  complaint_kind_ = kind;
  station_.tell(Severity::kWarning, kind, text);
}

asio::awaitable<void> LiveLine::read_until_lost() {
  while (stream_.is_open()) {
    const auto target = asio::buffer(buffer_);
    auto [error, size] = co_await stream_.async_read_some(target, kUse);
    if (size > 0) take(size);
    if (!error) continue;
    if (stopping_ || error == asio::error::operation_aborted) break;
    // A pty and some drivers say "end of file" for an empty read; only a line that is really gone ends the session.
    if (error == asio::error::eof && !line_is_gone(stream_.native_handle())) {
      pause_timer_.expires_after(std::chrono::milliseconds(20));
      co_await pause_timer_.async_wait(kUse);
      continue;
    }
    const std::string why = error == asio::error::eof ? "unplugged (end of file)" : error.message();
    station_.set_state(LineState::kConnecting, why);
    lose("line_lost", "lost: " + why);
  }
}

void LiveLine::take(std::size_t size) {
  const std::int64_t arrival_ns = arrival_.now_ns();
  last_data_ = last_progress_ = Clock::now();
  if (!begun_) {
    begun_ = true;
    station_.begin_session(arrival_ns);
    station_.set_state(LineState::kReceiving);
    station_.tell(Severity::kInfo, "line_receiving", station_.setup().config.line.device + ": receiving");
    retry_ = std::chrono::duration<double>(station_.setup().config.line.retry_min_s);
    complaint_.clear();
    complaint_kind_.clear();
  }
  station_.feed({buffer_.data(), size}, arrival_ns);
}

void LiveLine::lose(const char* kind, const std::string& why) {
  complain(kind, station_.setup().config.line.device + ": " + why + "; opening it again until data comes");
  boost::system::error_code ignored;
  stream_.close(ignored);
  station_.finish();
}

// One wake-up a second at most, not one per read: silence, waiting candidates, and a host clock that was set.
asio::awaitable<void> LiveLine::watch() {
  while (!stopping_) {
    const auto silence = as_steady(std::chrono::duration<double>(station_.setup().config.line.silence_s));
    const auto due = stream_.is_open() ? last_data_ + silence : Clock::now() + silence;
    const auto next = std::clamp(due, Clock::now() + std::chrono::milliseconds(10), Clock::now() + std::chrono::seconds(1));
    watch_timer_.expires_at(next);
    co_await watch_timer_.async_wait(kUse);
    if (stopping_ || !stream_.is_open()) continue;
    station_.expire(arrival_.now_ns());
    station_.line_hardware(read_line_counters(stream_.native_handle()));
    if (const std::int64_t step = arrival_.check()) {
      station_.tell(Severity::kWarning, "host_clock", fmt::format("the host clock was set by {:+.3f} s; the window begins anew", static_cast<double>(step) * 1e-9));
      station_.begin_session(arrival_.now_ns());
    }
    if (Clock::now() - last_data_ < silence) continue;
    const std::string why = fmt::format("no data for {} s", station_.setup().config.line.silence_s);
    station_.set_state(LineState::kSilent, why);
    lose("line_silent", why);
  }
}

asio::awaitable<void> LiveLine::pause() {
  last_progress_ = Clock::now() + as_steady(retry_);
  pause_timer_.expires_after(as_steady(retry_));
  co_await pause_timer_.async_wait(kUse);
  retry_ = std::min(retry_ * 2, std::chrono::duration<double>(station_.setup().config.line.retry_max_s));
}

}  // namespace prism
