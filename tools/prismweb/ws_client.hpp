// SPDX-License-Identifier: MIT
// A client of the WebSocket, whatever stream it is on: its token, its requests, its wishes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "tools/prismweb/topics.hpp"

namespace prism::prismweb {

class Hub;
class Site;

/// The way out to a client.
class Channel {
 public:
  virtual ~Channel() = default;
  /// An answer: it is never left out; a client that lets too many of them lie is closed.
  virtual void answer(const Text& text) = 0;
  /// What comes by itself: left out, counted and told where the client is too slow.
  virtual void batch(const std::string& instance, const Text& text, std::uint64_t rows) = 0;
};

class WsClient final : public Subscriber, public std::enable_shared_from_this<WsClient> {
 public:
  WsClient(Site& site, Channel& channel);
  ~WsClient() override;
  WsClient(const WsClient&) = delete;
  WsClient& operator=(const WsClient&) = delete;

  /// A message of the client. False: it may not stay.
  bool message(std::string_view text);

  bool is_let_in() const { return let_in_; }
  void tell(const Text& text) { channel_.answer(text); }
  void deliver(const std::string& instance, const Text& text, std::uint64_t rows) override {
    channel_.batch(instance, text, rows);
  }

 private:
  bool let_in(std::string_view text);
  void request(std::string_view text);
  void subscribe(Hub& hub, const std::string& id, const nlohmann::json& params, bool on);
  void answer(const std::string& id, const std::string& instance, std::string_view member);

  Site& site_;
  std::weak_ptr<Site> there_;  ///< at the end of the program it may be gone first
  Channel& channel_;
  bool let_in_ = false;
  int under_way_ = 0;
};

}  // namespace prism::prismweb
