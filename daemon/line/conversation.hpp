// SPDX-License-Identifier: MIT
// Sends the commands of one open line: start-up, then polls; at the end the stop commands.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/commands.hpp"
#include "drivers/transport/transport.hpp"

namespace prism::line {

/// Belongs to one open line and ends with it, so that a line never has two pollers. Not thread-safe.
class Conversation {
 public:
  /// Functions of the owner. No function may destroy the conversation, except `failed`, which is called last.
  struct Owner {
    std::function<void(std::span<const std::uint8_t>)> sent;  ///< these bytes went out
    std::function<void(const std::string& step)> starting;    ///< "step 2 of 5"
    std::function<void()> started;                            ///< all start-up commands were answered
    /// The line must be reopened: a device did not answer as expected (`kind` "line_start_up"), or a write failed
    /// ("line_lost").
    std::function<void(const char* kind, const std::string& why)> failed;
  };

  /// `line` and `poller`, null without a poll, must outlive this.
  Conversation(boost::asio::io_context& io, transport::Transport& line, const wire::Commands& commands,
               drivers::Poller* poller, Owner owner);
  ~Conversation() = default;
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  /// The line is open, or its device must be started again.
  void start();
  /// Sends the stop commands instead of all others; is_stopping() is false when they are done.
  void stop();
  bool is_stopping() const { return stopping_ && start_up_.has_value(); }
  bool is_starting() const { return !stopping_ && start_up_.has_value(); }
  /// Bytes arrived, with `frames` complete frames. May destroy this: call it last.
  void received(std::span<const std::uint8_t> bytes, std::uint64_t frames);
  /// Sends bytes of an administrator. Errors: the line does not accept them now.
  Result<void> send(std::span<const std::uint8_t> bytes);

 private:
  using Clock = std::chrono::steady_clock;

  void proceed();
  void proceed_start_up(Clock::time_point now);
  void fail(const char* kind, std::string why);
  bool put(std::span<const std::uint8_t> bytes);
  bool drain();
  void wait_until(Clock::time_point when);

  transport::Transport& line_;
  const wire::Commands commands_;
  const Owner owner_;
  boost::asio::steady_timer timer_;
  std::shared_ptr<int> alive_ = std::make_shared<int>();  ///< handlers of a destroyed conversation have no effect
  std::optional<drivers::StartUp> start_up_;              ///< also the stop commands
  drivers::Poller* poller_;
  std::vector<std::uint8_t> unsent_;
  std::string write_error_;
  bool stopping_ = false;
};

}  // namespace prism::line
