// SPDX-License-Identifier: MIT
#include "tools/prismweb/password_authenticator.hpp"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <utility>

#include "tools/prismweb/access.hpp"
#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/connection.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
constexpr std::size_t kMaxKnown = 64;

SteadyTime now() { return std::chrono::steady_clock::now(); }

}  // namespace

/// A waiting request.
struct PasswordAuthenticator::Ticket {
  explicit Ticket(asio::io_context& io) : done(io, asio::steady_timer::time_point::max()) {}
  AuthResult result = AuthResult::kBusy;
  bool is_abandoned = false;  ///< its connection ended
  asio::steady_timer done;    ///< cancelled when the result is known
};

/// A password to compare, shared by the parallel requests of a browser.
struct PasswordAuthenticator::Pending {
  std::string name, password;
  std::vector<std::shared_ptr<Ticket>> tickets;
};

PasswordAuthenticator::PasswordAuthenticator(asio::io_context& io, PasswordHashes hashes)
    : io_(io), hashes_(std::move(hashes)), salt_(is_required() ? make_token() : ""), wake_(io) {}

PasswordAuthenticator::~PasswordAuthenticator() = default;

std::string PasswordAuthenticator::digest_of(const std::string& authorization) const {
  const std::string text = salt_ + authorization;
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  ::EVP_Digest(text.data(), text.size(), digest.data(), &size, ::EVP_sha256(), nullptr);
  return {digest.begin(), digest.begin() + size};
}

asio::awaitable<AuthResult> PasswordAuthenticator::authenticate(std::string authorization,
                                                                std::shared_ptr<Connection> connection) {
  const auto given = basic_of(authorization);
  if (!given) co_return AuthResult::kWrong;
  const std::string digest = digest_of(authorization);
  if (known_.contains(digest)) {
    connection->user = given->first;
    co_return AuthResult::kRight;
  }
  const Key key(connection->address, digest);
  const std::shared_ptr<Ticket> ticket = enqueue(key, given->first, given->second);
  if (!ticket) co_return AuthResult::kBusy;
  connection->on_end = [ticket] {
    ticket->is_abandoned = true;
    ticket->done.cancel();
  };
  co_await ticket->done.async_wait(kUse);  // never expires: cancelled by the result or when the connection closes
  connection->on_end = nullptr;
  if (ticket->result != AuthResult::kRight) co_return ticket->result;
  if (!known_.contains(digest)) co_return AuthResult::kBusy;  // the passwords were replaced meanwhile
  connection->user = given->first;
  co_return AuthResult::kRight;
}

std::shared_ptr<PasswordAuthenticator::Ticket> PasswordAuthenticator::enqueue(const Key& key, std::string name,
                                                                              std::string password) {
  auto ticket = std::make_shared<Ticket>(io_);
  if (const auto same = pending_.find(key); same != pending_.end()) {
    same->second->tickets.push_back(ticket);
    return ticket;
  }
  if (!queue_.add(key, now())) return nullptr;
  pending_[key] = std::make_unique<Pending>(Pending{std::move(name), std::move(password), {ticket}});
  compare_next();
  return ticket;
}

void PasswordAuthenticator::compare_next() {
  while (!is_comparing_) {
    for (const Key& key : queue_.take_expired(now())) settle(key, AuthResult::kBusy);
    const auto key = queue_.take(now());
    if (!key) break;
    const auto& tickets = pending_.at(*key)->tickets;
    const bool is_wanted =
        std::any_of(tickets.begin(), tickets.end(), [](const auto& one) { return !one->is_abandoned; });
    if (is_wanted)
      compare(*key);
    else
      settle(*key, AuthResult::kBusy);
  }
  const auto next = queue_.next_time(now());
  if (is_comparing_ || !next) return;
  wake_.expires_at(*next);
  wake_.async_wait([this](const boost::system::error_code& error) {
    if (!error) compare_next();
  });
}

void PasswordAuthenticator::compare(const Key& key) {
  is_comparing_ = true;
  const Pending& pending = *pending_.at(key);
  const auto own = hashes_.find(pending.name);
  const bool is_known = own != hashes_.end();
  const std::string hash = (is_known ? own : hashes_.begin())->second;  // the same time for an unknown name
  asio::post(thread_, [this, key, hash, is_known, password = pending.password] {
    const bool is_right = is_password(password, hash) && is_known;
    asio::post(io_, [this, key, hash, is_right] { compared(key, hash, is_right); });
  });
}

void PasswordAuthenticator::compared(const Key& key, const std::string& hash, bool is_right) {
  is_comparing_ = false;
  const std::string& name = pending_.at(key)->name;
  const auto own = hashes_.find(name);
  const bool is_outdated =
      is_right && (own == hashes_.end() || own->second != hash);  // the password was replaced meanwhile
  if (is_right && !is_outdated) {
    if (known_.size() >= kMaxKnown) known_.clear();
    known_.emplace(key.second, name);
    queue_.addresses().succeeded(key.first);
  } else if (!is_right) {
    queue_.addresses().failed(key.first, now());
  }
  settle(key, is_outdated ? AuthResult::kBusy : is_right ? AuthResult::kRight : AuthResult::kWrong);
  compare_next();
}

void PasswordAuthenticator::settle(const Key& key, AuthResult result) {
  const auto pending = pending_.extract(key);
  for (const auto& ticket : pending.mapped()->tickets) {
    ticket->result = result;
    ticket->done.cancel();
  }
}

bool PasswordAuthenticator::has_failures(const std::string& address) {
  const auto known = queue_.addresses().find(address, now());
  return known && known->failures > 0;
}

std::set<std::string> PasswordAuthenticator::replace(PasswordHashes hashes) {
  std::set<std::string> changed;
  for (const auto& [name, hash] : hashes_) {
    const auto found = hashes.find(name);
    if (found == hashes.end() || found->second != hash) changed.insert(name);
  }
  std::erase_if(known_, [&](const auto& known) { return changed.contains(known.second); });
  hashes_ = std::move(hashes);
  return changed;
}

}  // namespace prism::prismweb
