// SPDX-License-Identifier: MIT
#include "daemon/line/conversation.hpp"

#include <utility>

namespace prism::line {
namespace {

constexpr std::size_t kMostUnsent = 64 << 10;
constexpr std::chrono::milliseconds kRetryWrite{10};

}  // namespace

Conversation::Conversation(boost::asio::io_context& io, transport::Transport& line, const wire::Commands& commands,
                           drivers::Poller* poller, Owner owner)
    : line_(line), commands_(commands), owner_(std::move(owner)), timer_(io), poller_(poller) {}

void Conversation::start() {
  if (commands_.start && !commands_.start->empty()) start_up_.emplace(*commands_.start);
  if (!start_up_) owner_.started();
  if (poller_ != nullptr && !start_up_) poller_->begin(Clock::now());
  if (start_up_ || poller_ != nullptr) proceed();
}

void Conversation::stop() {
  stopping_ = true;
  poller_ = nullptr;
  start_up_.reset();
  if (!commands_.stop || commands_.stop->empty()) return;
  start_up_.emplace(*commands_.stop);
  proceed();
}

void Conversation::received(std::span<const std::uint8_t> bytes, std::uint64_t frames) {
  if (start_up_) {
    start_up_->received(bytes);
  } else if (poller_ != nullptr && frames > 0) {
    poller_->replied(Clock::now());
  } else {
    return;
  }
  proceed();
}

Result<void> Conversation::send(std::span<const std::uint8_t> bytes) {
  if (!put(bytes)) return make_error("send", write_error_);
  if (!unsent_.empty()) proceed();
  return {};
}

void Conversation::proceed() {
  const Clock::time_point now = Clock::now();
  if (!drain()) return fail("line_lost", write_error_);
  if (!unsent_.empty()) return wait_until(now + kRetryWrite);
  if (start_up_) return proceed_start_up(now);
  if (poller_ == nullptr) return;
  if (const auto request = poller_->proceed(now); !request.empty() && !put(request))
    return fail("line_lost", write_error_);
  wait_until(poller_->deadline());
}

void Conversation::proceed_start_up(Clock::time_point now) {
  for (auto bytes = start_up_->proceed(now); !bytes.empty(); bytes = start_up_->proceed(now)) {
    if (!put(bytes)) return fail("line_lost", write_error_);
  }
  if (start_up_->has_failed()) {
    const std::string why = (stopping_ ? "stop: " : "start-up: ") + start_up_->text();
    start_up_.reset();
    if (!stopping_) fail("line_start_up", why);
    return;
  }
  if (!start_up_->is_done()) {
    if (!stopping_) owner_.starting(start_up_->text());
    return wait_until(start_up_->deadline());
  }
  start_up_.reset();
  if (stopping_) return;
  owner_.started();
  if (poller_ == nullptr) return;
  poller_->begin(now);
  proceed();
}

// The owner destroys this object.
void Conversation::fail(const char* kind, std::string why) {
  const auto failed = owner_.failed;
  failed(kind, why);
}

bool Conversation::put(std::span<const std::uint8_t> bytes) {
  if (unsent_.size() + bytes.size() > kMostUnsent) {
    write_error_ = "the device does not take the bytes that are sent";
    return false;
  }
  unsent_.insert(unsent_.end(), bytes.begin(), bytes.end());
  return drain();
}

// Sends what the line takes now.
bool Conversation::drain() {
  if (unsent_.empty()) return true;
  const Result<std::size_t> taken = line_.write(unsent_);
  if (!taken) {
    write_error_ = taken.error().what;
    unsent_.clear();
    return false;
  }
  if (*taken > 0) owner_.sent({unsent_.data(), *taken});
  unsent_.erase(unsent_.begin(), unsent_.begin() + static_cast<std::ptrdiff_t>(*taken));
  return true;
}

void Conversation::wait_until(Clock::time_point when) {
  timer_.expires_at(when);
  timer_.async_wait([this, alive = std::weak_ptr<int>(alive_)](boost::system::error_code error) {
    if (!error && alive.lock()) proceed();
  });
}

}  // namespace prism::line
