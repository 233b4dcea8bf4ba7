// SPDX-License-Identifier: MIT
// Client for Foxglove: each stream of an axis is a channel, each row of a subscribed channel a message.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tools/prismweb/client.hpp"
#include "tools/prismweb/foxglove_protocol.hpp"

namespace prism::prismweb {

/// Authenticated by the HTTP request, before the upgrade to a WebSocket.
class FoxgloveClient final : public Client {
 public:
  FoxgloveClient(WebServer& server, Channel& channel);

  void begin() override;
  std::optional<CloseReason> message(std::string_view text, bool is_text) override;
  bool is_admitted() const override { return true; }
  void instances_changed(const Text& notification) override;
  std::string lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) const override;
  void deliver(const std::string& instance, const Text& batch, std::uint64_t rows) override;

 private:
  struct ChannelSubscription {
    std::uint32_t id, channel;  ///< id chosen by the client, channel by prismweb
  };
  void subscribe(const nlohmann::json& request);
  void unsubscribe(const nlohmann::json& request);
  void advertise();
  void subscribe();
  void send(const nlohmann::json& operation);
  void send_warning(const std::string& text);

  std::set<std::uint32_t> advertised_;
  std::map<FoxgloveTopic, ChannelSubscription> subscriptions_;
};

}  // namespace prism::prismweb
