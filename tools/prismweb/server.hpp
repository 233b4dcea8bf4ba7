// SPDX-License-Identifier: MIT
// The listening socket, HTTP and WebSocket connections, and what their clients have not read yet. The only part that
// uses Beast.
#pragma once

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "base/result.hpp"
#include "base/unix_socket.hpp"
#include "tools/prismweb/router.hpp"
#include "tools/prismweb/settings.hpp"

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
  void trim();  ///< as Server::trim_memory()

 private:
  friend Connection;
  std::list<Connection*> all_;                            ///< oldest first
  std::size_t unsent_bytes_ = 0, peak_unsent_bytes_ = 0;  ///< without those that are ending; peak: since the last trim
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

class Server {
 public:
  /// Listens on the address or the Unix socket (mode 0660) of the settings. Replaces a stale socket that has no
  /// listener.
  static Result<std::unique_ptr<Server>> open(boost::asio::io_context& io, const Settings& settings);

  std::uint16_t port() const { return port_; }
  /// Serves clients, at most 128 at a time, until the context ends. An HTTP client is closed if it is too slow (10 s
  /// for the first request, 60 s for later ones) or sends an invalid request: 431 for a header that is too long, 400
  /// for invalid HTTP, a field that is repeated although access depends on it, Transfer-Encoding, or a body. A
  /// WebSocket client is closed if it is rejected (code 1003 for binary data, 1008 for authentication, 1013 for too
  /// many clients), or does not read for 30 s.
  boost::asio::awaitable<void> serve(std::shared_ptr<Router> router);
  /// Returns freed memory to the system if much data was sent or discarded since the last call. Call periodically.
  void trim_memory() const { connections_->trim(); }

 private:
  using Protocol = boost::asio::generic::stream_protocol;
  explicit Server(boost::asio::io_context& io) : io_(io), acceptor_(io) {}

  boost::asio::io_context& io_;
  boost::asio::basic_socket_acceptor<Protocol> acceptor_;
  std::optional<OwnSocketFile> own_;  ///< of the Unix socket
  std::uint16_t port_ = 0;
  /// Shared, because connections left in the context at program exit outlive the server.
  const std::shared_ptr<Connections> connections_ = std::make_shared<Connections>();
};

}  // namespace prism::prismweb
