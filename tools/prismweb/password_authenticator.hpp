// SPDX-License-Identifier: MIT
// Checks names and passwords (HTTP Basic). bcrypt is slow, so one thread compares them, in a fair order between client
// addresses, and the digests of correct ones are cached.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tools/prismweb/comparison_queue.hpp"
#include "tools/prismweb/passwords.hpp"

namespace prism::prismweb {

struct Connection;

enum class AuthResult { kRight, kWrong, kBusy };

class PasswordAuthenticator {
 public:
  PasswordAuthenticator(boost::asio::io_context& io, PasswordHashes hashes);
  ~PasswordAuthenticator();

  /// False without passwords: authenticate() must not be called.
  bool is_required() const { return !hashes_.empty(); }

  /// Checks an Authorization field and sets the connection's user if it is correct. Returns kBusy (unchecked, it may be
  /// correct) if eight passwords of the client's address are waiting or this one waited 10 s. The connection's on_end()
  /// cancels the wait.
  boost::asio::awaitable<AuthResult> authenticate(std::string authorization, std::shared_ptr<Connection> connection);

  /// True if the address sent a wrong password within the last ten minutes, and no correct one since.
  bool has_failures(const std::string& address);

  /// Replaces the hashes. Returns the names that were removed or have another hash, and removes them from the cache.
  std::set<std::string> replace(PasswordHashes hashes);

 private:
  using Key = ComparisonQueue::Key;
  struct Ticket;
  struct Pending;

  std::shared_ptr<Ticket> enqueue(const Key& key, std::string name, std::string password);
  void compare_next();
  void compare(const Key& key);
  void compared(const Key& key, const std::string& hash, bool is_right);
  void settle(const Key& key, AuthResult result);
  std::string digest_of(const std::string& authorization) const;

  boost::asio::io_context& io_;
  PasswordHashes hashes_;
  std::string salt_;
  std::map<std::string, std::string> known_;         ///< digest of a correct Authorization field → name
  std::map<Key, std::unique_ptr<Pending>> pending_;  ///< waiting or being compared
  ComparisonQueue queue_;
  boost::asio::steady_timer wake_;
  bool is_comparing_ = false;
  boost::asio::thread_pool thread_{1};
};

}  // namespace prism::prismweb
