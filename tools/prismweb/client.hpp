// SPDX-License-Identifier: MIT
// Client of a WebSocket, independent of its protocol.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tools/prismweb/subscription_table.hpp"

namespace prism::prismweb {

class WebServer;

/// Output to a client.
class Channel {
 public:
  virtual ~Channel() = default;
  /// Sends a response. Responses are never dropped; the client is disconnected if too many are unread.
  virtual void answer(const Text& text) = 0;
  /// Sends notifications. Drops, counts and reports them if the client is too slow.
  virtual void batch(const std::string& instance, const Text& text, std::uint64_t rows) = 0;
};

/// Close code of RFC 6455 (section 7.4.1 and IANA's registry) and a reason of at most 123 bytes.
struct CloseReason {
  std::uint16_t code;
  std::string_view reason;
};

/// The destructor removes the client from the server and ends its subscriptions.
class Client : public Subscriber, public std::enable_shared_from_this<Client> {
 public:
  ~Client() override;
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Handles a message. Returns a reason if the client must be disconnected.
  virtual std::optional<CloseReason> message(std::string_view text, bool is_text) = 0;
  virtual bool is_admitted() const = 0;
  /// The list of instances changed; `notification` is prismweb's message.
  virtual void instances_changed(const Text& notification) = 0;
  /// Message to the client: `rows` were dropped now, `rows_total` in total.
  virtual std::string lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) const = 0;

 protected:
  Client(WebServer& server, Channel& channel);
  void add_to_server();
  WebServer& server() { return server_; }
  Channel& channel() { return channel_; }

 private:
  WebServer& server_;
  std::weak_ptr<WebServer> weak_server_;  ///< may be destroyed first at program exit
  Channel& channel_;
};

}  // namespace prism::prismweb
