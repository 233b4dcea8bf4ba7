// SPDX-License-Identifier: MIT
// Clients: their connections, what they have not read yet, and the requests of the WebSocket /ws.
#pragma once

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "tools/prismweb/gyro_proxy.hpp"
#include "tools/prismweb/router.hpp"

namespace prism::prismweb {

class Connections;

/// One connection, in the list of all until its destruction.
class Connection {
 public:
  Connection(std::shared_ptr<Connections> all, int fd);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Counts data that the client has not received yet. Closes the connection with the most if all have too much.
  void add_unsent(std::size_t bytes);
  void remove_unsent(std::size_t bytes);

  int fd;                 ///< -1 after closing
  bool is_known = false;  ///< the client sent a valid token or cookie

 private:
  friend Connections;
  void close();

  const std::shared_ptr<Connections> all_;
  std::list<Connection*>::iterator at_;
  std::size_t unsent_bytes_ = 0;
  bool is_ending_ = false;  ///< closed to make room
};

class Connections {
 public:
  static constexpr std::size_t kMaxConnections = 128, kMaxUnsentBytes = 128 << 20;

  /// Makes room for a new connection. If 128 are open, closes the oldest one of an unknown client. Returns false if the
  /// new connection must be rejected.
  bool make_room();
  std::size_t unsent_bytes() const { return unsent_bytes_; }
  /// Returns freed memory to the system if much data was sent or discarded since the last call. Call every few seconds.
  void trim();

 private:
  friend Connection;
  std::list<Connection*> all_;                            ///< oldest first
  std::size_t unsent_bytes_ = 0, peak_unsent_bytes_ = 0;  ///< without those that are ending; peak: since the last trim
};

/// Close code of RFC 6455 (section 7.4.1 and IANA's registry) and a reason of at most 123 bytes.
struct CloseReason {
  std::uint16_t code;
  std::string_view reason;
};

/// Texts for one client: at most 4 MiB, with one long response at a time. Counts dropped rows.
class SendQueue {
 public:
  static constexpr std::size_t kMaxBatchBytes = 1 << 20, kMaxResponseBytes = 9 << 18, kPauseBytes = 1 << 18;
  /// Counted for each text in addition to its size: the string, its shared pointer and the queue's entry.
  static constexpr std::size_t kTextBytes = 128;

  explicit SendQueue(std::shared_ptr<Connection> connection) : connection_(std::move(connection)) {}

  /// kLong: a long response; until is_sending_long() is false, the next one waits. kList: replaces an earlier one that
  /// still waits.
  enum Kind : std::size_t { kResponse, kLong, kList, kBatch, kKinds };
  void put(Text text, Kind kind);
  /// Queues a batch. If it does not fit, drops and counts it and all others until the queue has none: one gap instead
  /// of many.
  void put_batch(const std::string& instance, Text text, std::uint64_t rows);

  bool empty() const { return waiting_.empty(); }
  std::size_t bytes() const { return bytes_[kResponse] + bytes_[kLong] + bytes_[kList] + bytes_[kBatch]; }
  bool is_sending_long() const { return bytes_[kLong] > 0; }
  /// True while the client should send no further requests: its short responses are unread.
  bool is_paused() const { return bytes_[kResponse] > kPauseBytes; }

  /// The next text, which is counted until pop().
  const Text& front() const { return waiting_.front().text; }
  /// Removes the text that was sent. After the last batch, queues a "lost" for each instance with dropped rows.
  void pop();
  void clear();

 private:
  struct Lost {
    std::uint64_t rows = 0, rows_total = 0;
  };
  struct Waiting {
    Text text;
    Kind kind;
  };
  void count(const Waiting& one, bool is_added);

  std::shared_ptr<Connection> connection_;
  std::deque<Waiting> waiting_;
  std::array<std::size_t, kKinds> bytes_{};
  std::map<std::string, Lost> lost_;
  bool is_losing_ = false;
};

class WsClient final : public Subscriber, public std::enable_shared_from_this<WsClient> {
 public:
  /// `is_authenticated`: by the HTTP request; the first message needs no token.
  WsClient(std::shared_ptr<Router> router, std::shared_ptr<Connection> connection, bool is_authenticated);

  /// Handles a message. Returns a reason if the client must be disconnected.
  std::optional<CloseReason> message(std::string_view text, bool is_text);
  bool is_admitted() const { return is_admitted_; }
  bool is_paused() const { return queue_.is_paused(); }
  /// Returns when is_paused() may have changed.
  boost::asio::awaitable<void> progress();
  /// Waits for a text to send. Returns null after end(). Call sent() after each text.
  boost::asio::awaitable<Text> next();
  void sent();
  /// The connection ended.
  void end();

  void deliver(const std::string& instance, const Text& batch, std::uint64_t rows) override;
  void announce(const Text& notification) override;

 private:
  std::optional<CloseReason> admit(std::string_view text);
  void request(const nlohmann::json& request);
  void subscribe(const std::string& id, const std::string& instance, const nlohmann::json& params, bool on);
  boost::asio::awaitable<void> respond(std::string id, std::string instance, std::string method, nlohmann::json params);
  void answer(const std::string& id, const std::string& instance, const std::string& member, bool is_long = false);

  const std::shared_ptr<Router> router_;
  const std::shared_ptr<Connection> connection_;
  const bool is_authenticated_;
  bool is_admitted_ = false, is_ended_ = false;
  int pending_requests_ = 0;
  SendQueue queue_;
  Turns long_turn_;
  boost::asio::steady_timer changed_;  ///< cancelled if the queue changed
};

}  // namespace prism::prismweb
