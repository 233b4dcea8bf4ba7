// SPDX-License-Identifier: MIT
// All served instances: discovery, list, and batching in turn.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tools/client/instances.hpp"
#include "tools/prismweb/instance_proxy.hpp"

namespace prism::prismweb {

class Instances {
 public:
  /// `wanted`: entries of client::list_instances(); empty: all of the host.
  Instances(boost::asio::io_context& io, std::vector<std::string> wanted);

  /// Finds instances, every 2 s, and delivers batches, until the context ends.
  void start();

  InstanceProxy* find(const std::string& name);
  nlohmann::json listing() const;  ///< list of InstanceProxy::listing()
  const std::vector<std::unique_ptr<InstanceProxy>>& all() const { return proxies_; }

  std::function<void()> on_change;             ///< the list changed
  std::function<void(InstanceProxy&)> on_new;  ///< before its first connection

 private:
  boost::asio::awaitable<void> find_instances();
  boost::asio::awaitable<void> flush_in_turn();
  void ignore(const std::string& socket);
  void add(const client::InstanceSocket& instance);
  void flush_next();

  boost::asio::io_context& io_;
  std::vector<std::string> wanted_;
  std::vector<std::unique_ptr<InstanceProxy>> proxies_;
  std::set<std::string> ignored_;  ///< sockets with an invalid name, logged once
  std::size_t next_ = 0;
};

}  // namespace prism::prismweb
