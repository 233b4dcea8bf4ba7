// SPDX-License-Identifier: MIT
// One client of the socket: its subscriptions and its queue of text to be sent.
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
#include <utility>
#include <vector>

namespace prism::socket {

/// Whole lines, or a part of one, that several clients may send at the same time without a copy for each.
struct TextPart {
  explicit TextPart(std::string own) {
    auto shared = std::make_shared<const std::string>(std::move(own));
    text = *shared;
    owner = std::move(shared);
  }
  /// `text` stands in what `owner` keeps, and is never changed.
  TextPart(std::shared_ptr<const void> keeps, std::string_view part) : owner(std::move(keeps)), text(part) {}

  std::shared_ptr<const void> owner;
  std::string_view text;
};

struct Subscription {
  std::uint32_t sample_every = 0;  ///< every n-th sample of each axis; 0: none
  bool windows = false, events = false;
  std::uint32_t axes = kAllAxes;  ///< whose samples and windows: a bit for each, as the pipeline's

  static constexpr std::uint32_t kAllAxes = ~std::uint32_t{0};
};

class Client;

/// What waits for all clients together. Beyond the most, the one for which most waits is closed.
class ClientMemory {
 public:
  static constexpr std::size_t kMostBytes = 64 << 20;

  explicit ClientMemory(std::size_t most_bytes = kMostBytes) : most_bytes_(most_bytes) {}

  bool has_room(std::size_t bytes) const { return used_bytes_ + bytes <= most_bytes_; }
  std::size_t used_bytes() const { return used_bytes_; }
  void take(Client& client, std::size_t bytes);
  void give_back(Client& client, std::size_t bytes);

 private:
  const std::size_t most_bytes_;
  std::size_t used_bytes_ = 0;
  std::set<Client*> holders_;
};

/// Sends at once what the socket takes; queues the rest up to a limit; beyond it drops rows, counts them, and tells the
/// client how many once it reads again. Never waits.
class Client : public std::enable_shared_from_this<Client> {
 public:
  using Socket = boost::asio::local::stream_protocol::socket;
  using Clock = std::chrono::steady_clock;

  Client(Socket socket, std::size_t max_queued_bytes,
         std::shared_ptr<ClientMemory> memory = std::make_shared<ClientMemory>());
  ~Client();

  /// `rows`: how many are lost where the text is dropped.
  void send(const TextPart& text, std::uint64_t rows);
  /// Sends what the socket takes at once. Returns from where on `text` is still to be sent: the caller hands that to
  /// enqueue(). Nothing where all is sent, or dropped and counted as `rows` lost.
  std::optional<std::size_t> offer(std::string_view text, std::uint64_t rows);
  void enqueue(const TextPart& text, std::size_t sent);
  /// An answer to this client alone. Answers are never dropped: a client that goes on asking without
  /// reading is closed when four times the limit waits for it. A long one leaves in turns of kTurnBytes.
  void answer(std::string line);
  void answer(const std::vector<TextPart>& parts);
  void close();

  bool open() const { return socket_.is_open(); }
  /// The peer closed its end, whatever it sent before; one that only stopped sending did not.
  bool gone() const;
  std::uint64_t lost_rows() const { return lost_total_; }
  /// Peer of a unix socket may change things: root, or the user the daemon runs as.
  bool privileged() const;
  /// Whose process connected; nothing once it is closed.
  std::optional<std::uint32_t> user() const;
  std::size_t queued_bytes() const { return queued_bytes_; }

  void asked() { last_asked_ = Clock::now(); }
  /// Since when it asked for nothing; not at all where it subscribed to something.
  Clock::duration idle() const;

  Subscription subscription;
  Socket& socket() { return socket_; }

 private:
  void push(const TextPart& text, std::size_t sent);
  std::size_t send_now(std::string_view text, std::size_t from);
  void wait_until_writable();
  void drain();
  void tell_loss();

  struct Queued {
    TextPart part;
    std::size_t sent;
  };
  static constexpr std::size_t kTurnBytes = 64 << 10;  ///< then others have their turn
  Socket socket_;
  const std::size_t max_queued_bytes_;
  std::deque<Queued> queue_;
  std::size_t queued_bytes_ = 0;
  std::uint64_t lost_ = 0, lost_total_ = 0;
  bool waiting_ = false;
  const std::shared_ptr<ClientMemory> memory_;
  Clock::time_point last_asked_ = Clock::now();
};

}  // namespace prism::socket
