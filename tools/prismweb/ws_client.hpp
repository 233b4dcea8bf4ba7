// SPDX-License-Identifier: MIT
// Client of the WebSocket /ws: authentication, requests, subscriptions.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "tools/prismweb/client.hpp"

namespace prism::prismweb {

class InstanceProxy;

class WsClient final : public Client {
 public:
  /// `is_authenticated`: the HTTP request was authenticated; the first message needs no token.
  WsClient(WebServer& server, Channel& channel, bool is_authenticated)
      : Client(server, channel), is_authenticated_(is_authenticated) {}

  std::optional<CloseReason> message(std::string_view text, bool is_text) override;
  bool is_admitted() const override { return is_admitted_; }
  void instances_changed(const Text& notification) override { channel().answer(notification); }
  std::string lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) const override;
  void deliver(const std::string& instance, const Text& text, std::uint64_t rows) override {
    channel().batch(instance, text, rows);
  }

 private:
  std::optional<CloseReason> admit(std::string_view text);
  void request(std::string_view text);
  void subscribe(InstanceProxy& proxy, const std::string& id, const nlohmann::json& params, bool on);
  void answer(const std::string& id, const std::string& instance, std::string_view member);

  bool is_authenticated_, is_admitted_ = false;
  int pending_requests_ = 0;
};

}  // namespace prism::prismweb
