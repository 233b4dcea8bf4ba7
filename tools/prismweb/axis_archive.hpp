// SPDX-License-Identifier: MIT
// What is known of one axis over time: the last hours in memory, minutes and hours on the disk, both kept up with
// prismd's log.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "tools/prismweb/async_store.hpp"
#include "tools/prismweb/instance_proxy.hpp"
#include "tools/prismweb/recent.hpp"

namespace prism::prismweb {

class AxisArchive : public std::enable_shared_from_this<AxisArchive> {
 public:
  /// `store` may be null: none is kept.
  AxisArchive(boost::asio::io_context& io, InstanceProxy& proxy, std::string axis, std::unique_ptr<AsyncStore> store);

  /// prismd is connected: fetches what was missed, and goes on.
  void follow();
  /// Keeps what was not kept yet.
  void finish();
  void window(const nlohmann::json& params);

  const std::string& name() const { return axis_; }
  const RecentSeconds& recent() const { return recent_; }
  /// Of the store as it was last told; null where there is none.
  const AsyncStore::Known* known() const { return has_log_ && known_.open ? &known_ : nullptr; }
  AsyncStore& store() { return *store_; }
  /// 0 to 1, 1 where the store is up to date; nothing where none is kept.
  std::optional<double> building() const;

 private:
  void go_on();
  void ask();
  void take(std::string_view member, const std::string& from);
  void take(const Error& refused);
  void on_change(const AsyncStore::Known& known);
  void rest(std::chrono::milliseconds pause);
  void take_history(std::string_view member);
  void say(const std::string& what);

  InstanceProxy& proxy_;
  std::string axis_;
  RecentSeconds recent_;
  std::unique_ptr<AsyncStore> store_;
  AsyncStore::Known known_;
  boost::asio::steady_timer pause_;
  /// A page is asked for until the store has it: what a disk that hangs is given does not grow.
  bool has_log_ = true, asking_ = false, behind_ = true;
  std::string said_;
};

}  // namespace prism::prismweb
