// SPDX-License-Identifier: MIT
#include "daemon/output/output_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/host_time.hpp"

namespace prism::output {
namespace {

using pipeline::LineState;
constexpr std::chrono::milliseconds kLongestWait{100}, kTryAgain{5}, kRest{20};

}  // namespace

OutputLine::OutputLine(boost::asio::io_context& io, pipeline::Setup::Output setup, std::size_t number,
                       pipeline::OutputStatus& status, Problems& problems, pipeline::Tell tell,
                       std::unique_ptr<pipeline::CaptureSink> capture)
    : io_(io),
      setup_(std::move(setup)),
      name_(fmt::format("output {}: {}", number, transport::describe(setup_.line))),
      fault_key_(fmt::format("output {}", number)),
      slow_key_(fmt::format("output {} slow", number)),
      status_(status),
      problems_(problems),
      tell_(std::move(tell)),
      capture_(std::move(capture)),
      retry_timer_(io),
      flush_timer_(io) {}

void OutputLine::set(LineState state, const std::string& detail) {
  if (status_.state != state) status_.since_ns = host_time_ns();
  status_.state = state;
  status_.detail = detail;
}

void OutputLine::open() {
  auto line = transport::open(io_, setup_.line);
  if (!line) return lose(line.error().text());
  transport_ = std::move(*line);
  if (transport_->opening().empty()) return opened();
  set(LineState::kConnecting, transport_->opening());
  listen();
}

void OutputLine::opened() {
  is_open_ = true;
  retry_.reset();
  set(LineState::kReceiving, "");
  tell_(pipeline::Severity::kInfo, "output_open", name_ + ": open");
  problems_.forget(fault_key_);
  if (capture_) capture_->mark_opened(host_time_ns());
  listen();
}

void OutputLine::listen() {
  transport_->wait([this, alive = std::weak_ptr(alive_), open = transport_.get()](const auto& error) {
    if (!error && !alive.expired() && transport_.get() == open) readable();
  });
}

// Bytes of the far end are ignored, but a read finds that it is gone.
void OutputLine::readable() {
  using Kind = transport::Received::Kind;
  const transport::Received received = transport_->read(ignored_);
  if (received.kind == Kind::kLost) return lose(received.why);
  if (!is_open_) {
    if (const std::string step = transport_->opening(); !step.empty()) {
      set(LineState::kConnecting, step);
      return listen();
    }
    return opened();
  }
  if (received.kind != Kind::kEmpty) return listen();
  retry_timer_.expires_after(kRest);
  retry_timer_.async_wait([this, alive = std::weak_ptr(alive_), open = transport_.get()](const auto& error) {
    if (!error && !alive.expired() && transport_.get() == open) listen();
  });
}

void OutputLine::lose(const std::string& why) {
  set(LineState::kConnecting, why);
  problems_.set(
      fault_key_,
      {.kind = "output", .level = Problem::Level::kFailed, .text = fmt::format("{}: {}; no frame leaves", name_, why)});
  is_open_ = false;
  for (const Chunk& chunk : waiting_) status_.lost_bytes += chunk.bytes.size() - chunk.written;
  waiting_.clear();
  transport_.reset();
  pause();
}

void OutputLine::pause() {
  retry_timer_.expires_after(retry_.next(setup_.config.line, transport::is_present(setup_.line)));
  retry_timer_.async_wait([this, alive = std::weak_ptr(alive_)](const auto& error) {
    if (!error && !alive.expired() && !transport_) open();
  });
}

void OutputLine::send(std::span<const std::uint8_t> bytes, Clock::time_point read_at, std::int64_t arrival_ns) {
  if (!is_open_) {
    status_.lost_bytes += bytes.size();
    return;
  }
  waiting_.push_back({{bytes.begin(), bytes.end()}, 0, read_at, arrival_ns});
  flush();
}

void OutputLine::flush() {
  while (!waiting_.empty()) {
    Chunk& chunk = waiting_.front();
    const auto written = transport_->write(std::span(chunk.bytes).subspan(chunk.written));
    if (!written) return lose(written.error().what);
    status_.bytes += *written;
    chunk.written += *written;
    if (chunk.written < chunk.bytes.size()) break;
    status_.add_latency(std::chrono::duration<double>(Clock::now() - chunk.read_at).count());
    if (capture_) capture_->data(chunk.bytes, chunk.arrival_ns);
    waiting_.pop_front();
  }
  if (waiting_.empty()) return;
  drop_old();
  if (std::exchange(flushes_later_, true)) return;
  flush_timer_.expires_after(kTryAgain);
  flush_timer_.async_wait([this, alive = std::weak_ptr(alive_)](const auto& error) {
    if (error || alive.expired()) return;
    flushes_later_ = false;
    if (is_open_) flush();
  });
}

void OutputLine::drop_old() {
  if (Clock::now() - waiting_.front().read_at < kLongestWait) return;
  const auto first = waiting_.begin() + (waiting_.front().written > 0 ? 1 : 0);
  const auto last = std::prev(waiting_.end());
  if (first >= last) return;
  std::uint64_t lost = 0;
  for (auto chunk = first; chunk != last; ++chunk) lost += chunk->bytes.size();
  waiting_.erase(first, last);
  status_.lost_bytes += lost;
  problems_.set(slow_key_, {.kind = "output",
                            .level = Problem::Level::kFailed,
                            .text = name_ + ": takes fewer bytes than the gyro sends; the oldest are lost",
                            .unit = "bytes",
                            .count = lost});
}

void OutputLine::tick() {
  if (transport_) transport_->turn_away();
  if (waiting_.empty()) problems_.clear(slow_key_, name_ + ": takes all bytes again", 3);
  if (capture_) capture_->flush();
}

}  // namespace prism::output
