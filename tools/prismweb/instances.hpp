// SPDX-License-Identifier: MIT
// All instances that are served: found, listed, and given their turns to speak.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tools/prismweb/instance_proxy.hpp"

namespace prism::prismweb {

class Instances {
 public:
  /// `wanted`: names, or paths of sockets; empty: all of the host, also those that come later.
  Instances(boost::asio::io_context& io, std::vector<std::string> wanted);

  /// Finds instances (each 2 s where none are named) and hands out batches, until the context ends.
  void start();

  InstanceProxy* find(const std::string& name);
  nlohmann::json listing() const;  ///< a list of Hub::listing()
  const std::vector<std::unique_ptr<InstanceProxy>>& all() const { return proxies_; }

  std::function<void()> on_change;             ///< the list is another
  std::function<void(InstanceProxy&)> on_new;  ///< before it connects for the first time

 private:
  boost::asio::awaitable<void> look();
  boost::asio::awaitable<void> flush_in_turn();
  void ignore(const std::string& socket);
  void add(const std::string& socket);
  void flush_next();

  boost::asio::io_context& io_;
  std::vector<std::string> wanted_;
  std::vector<std::unique_ptr<InstanceProxy>> proxies_;
  std::set<std::string> ignored_;  ///< sockets whose name is no instance's, which is logged once
  std::size_t turn_ = 0;
};

}  // namespace prism::prismweb
