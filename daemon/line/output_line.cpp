// SPDX-License-Identifier: MIT
#include "daemon/line/output_line.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "base/host_time.hpp"

namespace prism::line {
namespace {

using pipeline::LineState;
constexpr std::chrono::milliseconds kLongestWait{100}, kTryAgain{5}, kRest{20};

}  // namespace

OutputLine::OutputLine(boost::asio::io_context& io, pipeline::Device& device, std::size_t index, pipeline::Tell tell,
                       std::unique_ptr<pipeline::CaptureSink> capture)
    : io_(io),
      setup_(device.setup.outputs[index]),
      fault_key_(fmt::format("output {}", index + 1)),
      slow_key_(fault_key_ + " slow"),
      name_(fault_key_ + ": " + transport::describe(setup_.line)),
      status_(device.output_lines[index]),
      problems_(device.problems),
      tell_(std::move(tell)),
      capture_(std::move(capture)),
      again_(io),
      backlog_(io) {
  proceed();
}

void OutputLine::wait(boost::asio::steady_timer& timer, Clock::duration duration, void (OutputLine::*then)()) {
  timer.expires_after(duration);  // ends another wait
  timer.async_wait([this, then, alive = std::weak_ptr(alive_)](const auto& error) {
    if (!error && !alive.expired()) (this->*then)();
  });
}

void OutputLine::listen() {
  transport_->wait([this, number = ++waits_, alive = std::weak_ptr(alive_)](const auto& error) {
    if (!error && !alive.expired() && number == waits_ && transport_) proceed();
  });
}

// Bytes of the far end are ignored, but a read opens the line further, and finds that the far end is gone.
void OutputLine::proceed() {
  std::array<std::uint8_t, 4096> ignored;
  transport::Received received;
  if (transport_) {
    received = transport_->read(ignored);
  } else if (auto line = transport::open(io_, setup_.line)) {
    transport_ = std::move(*line);
  } else {
    return lose(line.error().text());
  }
  if (received.kind == transport::Received::Kind::kLost) return lose(received.why);
  if (const std::string step = transport_->opening(); !step.empty()) {
    status_.set(LineState::kConnecting, step, host_time_ns());
  } else if (!is_open()) {
    retry_.reset();
    status_.set(LineState::kReceiving, "", host_time_ns());
    tell_(pipeline::Severity::kInfo, "output_open", name_ + ": open");
    problems_.forget(fault_key_);
    if (capture_) capture_->record(drivers::CaptureEvent::kOpened, {}, host_time_ns());
  }
  received.kind == transport::Received::Kind::kEmpty ? wait(again_, kRest, &OutputLine::proceed) : listen();
  if (is_open()) flush();
}

void OutputLine::lose(const std::string& why) {
  status_.set(LineState::kConnecting, why, host_time_ns());
  problems_.set(
      fault_key_,
      {.kind = "output", .level = Problem::Level::kFailed, .text = fmt::format("{}: {}; no frame leaves", name_, why)});
  for (const Chunk& chunk : waiting_) status_.lost_bytes += chunk.bytes.size() - chunk.written;
  waiting_.clear();
  transport_.reset();
  wait(again_, retry_.next(setup_.config.line, transport::is_present(setup_.line)), &OutputLine::proceed);
}

void OutputLine::send(std::span<const std::uint8_t> bytes, Clock::time_point read_at, std::int64_t arrival_ns) {
  if (!is_open()) {
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
    status_.latencies_s.push_back(std::chrono::duration<float>(Clock::now() - chunk.read_at).count());
    if (capture_) capture_->record(drivers::CaptureEvent::kData, chunk.bytes, chunk.arrival_ns);
    waiting_.pop_front();
  }
  if (waiting_.empty()) return;
  drop_old();
  wait(backlog_, kTryAgain, &OutputLine::flush);
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

}  // namespace prism::line
