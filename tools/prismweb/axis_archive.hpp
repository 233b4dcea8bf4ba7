// SPDX-License-Identifier: MIT
// History of one axis: the last two hours in memory, minutes and hours on disk, both updated from prismd's log.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "tools/client/response.hpp"
#include "tools/prismweb/async_store.hpp"
#include "tools/prismweb/instance_proxy.hpp"
#include "tools/prismweb/recent.hpp"
#include "tools/prismweb/turn_queue.hpp"

namespace prism::prismweb {

class AxisArchive : public std::enable_shared_from_this<AxisArchive> {
 public:
  /// `store`: null to store nothing on disk.
  AxisArchive(boost::asio::io_context& io, InstanceProxy& proxy, std::string axis, std::unique_ptr<AsyncStore> store);

  /// Call when prismd is connected. Loads missed rows and follows the log.
  void follow();
  /// Writes uncommitted seconds to disk.
  void finish();
  void window(const nlohmann::json& params);

  const std::string& name() const { return axis_; }
  const RecentSeconds& recent() const { return recent_; }
  /// Last reported state of the store; null if there is no open store or no log.
  const AsyncStore::Status* store_status() const { return has_log_ && status_.open ? &status_ : nullptr; }
  AsyncStore& store() { return *store_; }
  /// Requests for data in the log or in the store.
  TurnQueue& log_turns() { return *log_turns_; }
  TurnQueue& store_turns() { return *store_turns_; }
  /// Why the store cannot be used or was rebuilt; empty: no problem, or no store.
  const std::string& problem() const { return status_.problem; }
  /// Progress of the store, 0 to 1 (up to date). Returns nullopt if the axis has no log or no usable store.
  std::optional<double> building() const;

 private:
  void continue_reading();
  void request_page();
  void store_page(std::string_view member, const std::string& from);
  void handle_error(const client::RequestError& error);
  void on_change(const AsyncStore::Status& status);
  void continue_after(std::chrono::milliseconds pause);
  void take_history(std::string_view member);
  void report(const std::string& what);

  InstanceProxy& proxy_;
  std::string axis_;
  RecentSeconds recent_;
  std::unique_ptr<AsyncStore> store_;
  AsyncStore::Status status_;
  const std::shared_ptr<TurnQueue> log_turns_ = std::make_shared<TurnQueue>();
  const std::shared_ptr<TurnQueue> store_turns_ = std::make_shared<TurnQueue>();
  boost::asio::steady_timer pause_;
  /// reading_: one page is requested at a time, until the store has it, so that a blocked disk does not fill memory.
  bool has_log_ = true, reading_ = false, behind_ = true;
  std::string store_problem_;  ///< as told
};

}  // namespace prism::prismweb
