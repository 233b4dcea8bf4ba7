// SPDX-License-Identifier: MIT
// Who comes in by name and password. bcrypt is slow: a thread of its own compares, and what was right is remembered by
// its digest.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "tools/prismweb/passwords.hpp"

namespace prism::prismweb {

enum class Pass { kYes, kNo, kBusy };

class Gate {
 public:
  Gate(boost::asio::io_context& io, PasswordHashes hashes);

  bool asks() const { return !hashes_.empty(); }
  /// Whether an Authorization field is right. One that is wrong is answered after a second. Eight are compared at a
  /// time: another one is told so, and may be right.
  boost::asio::awaitable<Pass> lets_in(std::string authorization);

 private:
  struct Comparison;
  std::shared_ptr<Comparison> compare(const std::string& digest, const std::string& name, const std::string& password);
  std::string digest_of(const std::string& authorization) const;

  boost::asio::io_context& io_;
  PasswordHashes hashes_;
  std::string salt_;
  std::set<std::string> known_;
  std::map<std::string, std::shared_ptr<Comparison>> comparisons_;  ///< by digest: a browser asks several at once
  boost::asio::thread_pool thread_{1};
};

}  // namespace prism::prismweb
