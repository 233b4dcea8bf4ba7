// SPDX-License-Identifier: MIT
// Somebody at the other end of a WebSocket, whatever protocol it speaks.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tools/prismweb/subscription_table.hpp"

namespace prism::prismweb {

class WebServer;

/// The way out to a client. A text that begins with '{' is sent as text, another one as binary data.
class Channel {
 public:
  virtual ~Channel() = default;
  /// An answer: it is never left out; a client that lets too many of them lie is closed.
  virtual void answer(const Text& text) = 0;
  /// What comes by itself: left out, counted and told where the client is too slow.
  virtual void batch(const std::string& instance, const Text& text, std::uint64_t rows) = 0;
};

/// Why a client may not stay: a close code of RFC 6455 (section 7.4.1 and IANA's registry), and words of at most 123
/// bytes.
struct CloseReason {
  std::uint16_t code;
  std::string_view reason;
};

/// Leaves the site and all that it listened to when it goes.
class Client : public Subscriber, public std::enable_shared_from_this<Client> {
 public:
  ~Client() override;
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// The connection stands.
  virtual void begin() {}
  /// A message of the client. An answer: it may not stay.
  virtual std::optional<CloseReason> message(std::string_view text, bool is_text) = 0;
  virtual bool is_let_in() const = 0;
  /// The list of instances is another: prismweb's notification of it.
  virtual void instances_changed(const Text& notification) = 0;
  /// What tells the client that so many rows were left out, now and in all.
  virtual std::string lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) const = 0;

 protected:
  Client(WebServer& server, Channel& channel);
  void enter();
  WebServer& server() { return server_; }
  Channel& channel() { return channel_; }

 private:
  WebServer& server_;
  std::weak_ptr<WebServer> there_;  ///< at the end of the program it may be gone first
  Channel& channel_;
};

}  // namespace prism::prismweb
