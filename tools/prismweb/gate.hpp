// SPDX-License-Identifier: MIT
// Who comes in by name and password. bcrypt is slow: a thread of its own compares, and what was right is remembered by
// its digest.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <set>
#include <string>

#include "tools/prismweb/passwords.hpp"

namespace prism::prismweb {

class Gate {
 public:
  Gate(boost::asio::io_context& io, PasswordHashes hashes);

  bool asks() const { return !hashes_.empty(); }
  /// Whether an Authorization field is right. One that is wrong is answered after a second; beyond eight at once at
  /// once, as wrong.
  boost::asio::awaitable<bool> lets_in(std::string authorization);

 private:
  std::string digest_of(const std::string& authorization) const;

  boost::asio::io_context& io_;
  PasswordHashes hashes_;
  std::string salt_;
  std::set<std::string> known_;
  int comparing_ = 0;
  boost::asio::thread_pool thread_{1};
};

}  // namespace prism::prismweb
