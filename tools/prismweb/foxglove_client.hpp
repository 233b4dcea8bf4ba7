// SPDX-License-Identifier: MIT
// Foxglove, looking at the gyros: what there is as channels, and of those that it subscribes to each row as a message.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tools/prismweb/client.hpp"
#include "tools/prismweb/foxglove_protocol.hpp"

namespace prism::prismweb {

/// It was let in before it became a WebSocket.
class FoxgloveClient final : public Client {
 public:
  FoxgloveClient(WebServer& server, Channel& channel);

  void begin() override;
  std::optional<CloseReason> message(std::string_view text, bool is_text) override;
  bool is_let_in() const override { return true; }
  void instances_changed(const Text& notification) override;
  std::string lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) const override;
  void deliver(const std::string& instance, const Text& batch, std::uint64_t rows) override;

 private:
  struct ChannelSubscription {
    std::uint32_t id, channel;  ///< the client's number, and ours
  };
  void subscribe(const nlohmann::json& request);
  void unsubscribe(const nlohmann::json& request);
  void advertise();
  void subscribe();
  void send(const nlohmann::json& operation);
  void complain(const std::string& text);

  std::set<std::uint32_t> advertised_;
  std::map<FoxgloveTopic, ChannelSubscription> subscriptions_;
};

}  // namespace prism::prismweb
