// SPDX-License-Identifier: MIT
#include "daemon/socket/client.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace prism::socket {

void ClientMemory::take(Client& client, std::size_t bytes) {
  used_bytes_ += bytes;
  holders_.insert(&client);
  while (used_bytes_ > most_bytes_) {
    (*std::max_element(holders_.begin(), holders_.end(), [](const Client* a, const Client* b) {
      return a->queued_bytes() < b->queued_bytes();
    }))->close();
  }
}

void ClientMemory::give_back(Client& client, std::size_t bytes) {
  used_bytes_ -= bytes;
  if (client.queued_bytes() == 0) holders_.erase(&client);
}

Client::Client(Socket socket, std::size_t max_queued_bytes, std::shared_ptr<ClientMemory> memory)
    : socket_(std::move(socket)), max_queued_bytes_(max_queued_bytes), memory_(std::move(memory)) {
  boost::system::error_code ignored;
  socket_.non_blocking(true, ignored);
}

Client::~Client() { close(); }

void Client::send(const Text& text, std::uint64_t rows) {
  if (!open()) return;
  std::size_t sent = 0;
  if (queue_.empty() && lost_ == 0) {
    sent = send_now(*text, 0);
    if (!open() || sent == text->size()) return;
  } else if (lost_ > 0 || queued_bytes_ + text->size() > max_queued_bytes_ || !memory_->has_room(text->size())) {
    lost_ += rows;  // drop all rows until the queue is empty: one gap instead of many
    lost_total_ += rows;
    return;
  }
  push(text, sent);
  wait_until_writable();
}

void Client::answer(std::string line) { answer({{std::make_shared<const std::string>(std::move(line))}}); }

void Client::answer(std::vector<Piece> line) {
  if (queued_bytes_ > 4 * max_queued_bytes_) return close();  // without this response: an hour of history is long
  for (Piece& piece : line) {
    if (open()) push(std::move(piece.text), piece.from);
  }
  if (open() && !waiting_) drain();
}

void Client::close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
  queue_.clear();
  memory_->give_back(*this, std::exchange(queued_bytes_, 0));
}

bool Client::gone() const {
  pollfd peer{const_cast<Socket&>(socket_).native_handle(), 0, 0};
  return ::poll(&peer, 1, 0) > 0 && (peer.revents & (POLLHUP | POLLERR)) != 0;
}

std::optional<std::uint32_t> Client::user() const {
  ucred peer{};
  socklen_t size = sizeof peer;
  auto& socket = const_cast<Socket&>(socket_);
  if (::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return std::nullopt;
  return peer.uid;
}

bool Client::privileged() const {
  const auto who = user();
  return who && (*who == 0 || *who == ::geteuid());
}

Client::Clock::duration Client::idle() const {
  return subscription.is_empty() ? Clock::now() - last_asked_ : Clock::duration::zero();
}

// Returns the number of bytes of `text` sent so far, `from` included. Closes the client if the peer is disconnected.
std::size_t Client::send_now(std::string_view text, std::size_t from) {
  while (from < text.size()) {
    const ssize_t sent =
        ::send(socket_.native_handle(), text.data() + from, text.size() - from, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent > 0) {
      from += static_cast<std::size_t>(sent);
    } else if (errno != EINTR) {
      if (errno != EAGAIN && errno != EWOULDBLOCK) close();
      break;
    }
  }
  return from;
}

void Client::push(Text text, std::size_t sent) {
  const std::size_t left = text->size() - sent;
  queue_.push_back({std::move(text), sent});
  queued_bytes_ += left;
  memory_->take(*this, left);
}

void Client::wait_until_writable() {
  if (waiting_ || !open()) return;
  waiting_ = true;
  socket_.async_wait(Socket::wait_write, [self = shared_from_this()](boost::system::error_code error) {
    self->waiting_ = false;
    if (!error) self->drain();
  });
}

void Client::drain() {
  for (std::size_t budget = kTurnBytes; open() && !queue_.empty();) {
    Piece& front = queue_.front();
    const std::size_t sent = send_now(std::string_view(*front.text).substr(0, front.from + budget), front.from);
    if (!open()) return;
    queued_bytes_ -= sent - front.from;
    memory_->give_back(*this, sent - front.from);
    budget -= sent - front.from;
    front.from = sent;
    const bool all = sent == front.text->size();
    if (all) queue_.pop_front();
    if ((!all || budget == 0) && !queue_.empty()) return wait_until_writable();
  }
  if (open() && lost_ > 0) tell_loss();
}

void Client::tell_loss() {
  const std::uint64_t rows = std::exchange(lost_, 0);
  answer(fmt::format("{{\"jsonrpc\":\"2.0\",\"method\":\"lost\",\"params\":{{\"rows\":{},\"rows_total\":{}}}}}\n", rows,
                     lost_total_));
}

}  // namespace prism::socket
