// SPDX-License-Identifier: MIT
// A client of the WebSocket, whatever stream it is on: its token, its requests, its wishes.
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
  /// `is_authenticated`: the request showed who it is, so that its first message needs no token.
  WsClient(WebServer& server, Channel& channel, bool is_authenticated)
      : Client(server, channel), is_authenticated_(is_authenticated) {}

  std::optional<CloseReason> message(std::string_view text, bool is_text) override;
  bool is_let_in() const override { return let_in_; }
  void instances_changed(const Text& notification) override { channel().answer(notification); }
  std::string lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) const override;
  void deliver(const std::string& instance, const Text& text, std::uint64_t rows) override {
    channel().batch(instance, text, rows);
  }

 private:
  std::optional<CloseReason> let_in(std::string_view text);
  void request(std::string_view text);
  void subscribe(InstanceProxy& proxy, const std::string& id, const nlohmann::json& params, bool on);
  void answer(const std::string& id, const std::string& instance, std::string_view member);

  bool is_authenticated_, let_in_ = false;
  int current_id_ = 0;
};

}  // namespace prism::prismweb
