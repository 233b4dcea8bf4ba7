// SPDX-License-Identifier: MIT
// One client of the socket: its subscription and its send queue.
#pragma once

#include <boost/asio/local/stream_protocol.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace prism::socket {

/// Complete lines, shared by the send queues of several clients.
using Text = std::shared_ptr<const std::string>;

/// The text from `from` on.
struct Piece {
  Text text;
  std::size_t from = 0;
};

struct Subscription {
  std::uint32_t sample_every = 0;  ///< every n-th sample of each axis; 0: none
  bool windows = false, events = false;
  std::uint32_t axes = kAllAxes;  ///< axes of the samples and windows: one bit each, in the pipeline's order

  static constexpr std::uint32_t kAllAxes = ~std::uint32_t{0};

  bool has(std::size_t axis) const { return (axes >> axis & 1) != 0; }
  bool is_empty() const { return sample_every == 0 && !windows && !events; }
  bool operator==(const Subscription&) const = default;
};

class Client;

/// Memory of all send queues together. Above the limit, the client with the longest queue is closed.
class ClientMemory {
 public:
  static constexpr std::size_t kMostBytes = 64 << 20;

  explicit ClientMemory(std::size_t most_bytes = kMostBytes) : most_bytes_(most_bytes) {}

  bool has_room(std::size_t bytes) const { return used_bytes_ + bytes <= most_bytes_; }
  void take(Client& client, std::size_t bytes);
  void give_back(Client& client, std::size_t bytes);

 private:
  const std::size_t most_bytes_;
  std::size_t used_bytes_ = 0;
  std::set<Client*> holders_;
};

/// Sends at once as much as the socket accepts and queues the rest. If the queue is full, drops rows, counts them, and
/// sends the count when the client reads again. Never waits.
class Client : public std::enable_shared_from_this<Client> {
 public:
  using Socket = boost::asio::local::stream_protocol::socket;
  using Clock = std::chrono::steady_clock;

  Client(Socket socket, std::size_t max_queued_bytes,
         std::shared_ptr<ClientMemory> memory = std::make_shared<ClientMemory>());
  ~Client();

  /// `rows`: number of rows that are lost if the text is dropped.
  void send(const Text& text, std::uint64_t rows);
  /// A response to this client. Responses are never dropped: a client that sends requests without reading is closed
  /// when its queue reaches four times the limit. Long responses are sent in parts of kTurnBytes.
  void answer(std::string line);
  /// The same response, in pieces that it may share with other clients.
  void answer(std::vector<Piece> line);
  void close();

  bool open() const { return socket_.is_open(); }
  /// True if the peer closed the connection (not if it only shut down sending).
  bool gone() const;
  std::uint64_t lost_rows() const { return lost_total_; }
  /// True for root and for the user that the daemon runs as: they may use `reload`.
  bool privileged() const;
  /// User of the connected process; nullopt after close.
  std::optional<std::uint32_t> user() const;
  std::size_t queued_bytes() const { return queued_bytes_; }

  void asked() { last_asked_ = Clock::now(); }
  /// Time since its last request; 0 with a subscription.
  Clock::duration idle() const;

  Subscription subscription;
  bool reads_rows = false;  ///< a request for log pages waits
  Socket& socket() { return socket_; }

 private:
  void push(Text text, std::size_t sent);
  std::size_t send_now(std::string_view text, std::size_t from);
  void wait_until_writable();
  void drain();
  void tell_loss();

  static constexpr std::size_t kTurnBytes = 64 << 10;  ///< then other clients are served
  Socket socket_;
  const std::size_t max_queued_bytes_;
  std::deque<Piece> queue_;  ///< from: the next byte to send
  std::size_t queued_bytes_ = 0;
  std::uint64_t lost_ = 0, lost_total_ = 0;
  bool waiting_ = false;
  const std::shared_ptr<ClientMemory> memory_;
  Clock::time_point last_asked_ = Clock::now();
};

}  // namespace prism::socket
