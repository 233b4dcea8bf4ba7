// SPDX-License-Identifier: MIT
// History of one axis: the last two hours in memory, minutes and hours on disk, seconds in prismd's log.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/disk_thread.hpp"
#include "tools/client/client.hpp"
#include "tools/prismweb/period_store.hpp"

namespace prism::prismweb {

/// The disk is reported as blocked after this time.
inline constexpr std::chrono::seconds kDiskTimeout{5};

/// The last seconds in memory, by begin.
class RecentSeconds {
 public:
  static constexpr std::int64_t kLength_s = 7200, kClockReset_s = 60;

  /// Inserts a second of the log. Replaces one of the same time; ignores one that is too old, or later than the current
  /// second: it is from before a reset of the clock.
  void put(const Period& second);
  /// Adds the current second. If it is over a minute older than the last one, the clock was reset: removes all others.
  void put_now(const Period& second);
  /// The current second is not known: prismd was connected again.
  void forget_now() { now_s_.reset(); }

  bool empty() const { return seconds_.empty(); }
  std::int64_t first_s() const { return seconds_.begin()->first; }
  std::int64_t last_s() const { return seconds_.rbegin()->first; }
  /// The seconds after `begin_s`.
  std::vector<Period> after(std::int64_t begin_s) const;

 private:
  std::map<std::int64_t, Period> seconds_;
  std::optional<std::int64_t> now_s_;
};

/// Limits how many tasks run at a time.
class Turns {
 public:
  Turns(boost::asio::io_context& io, int max) : max_(max), next_(io, boost::asio::steady_timer::time_point::max()) {}
  /// Returns when it is this task's turn, which ends with the destruction of the result. Must outlive the result.
  boost::asio::awaitable<std::shared_ptr<void>> take();

 private:
  const int max_;
  int running_ = 0;
  boost::asio::steady_timer next_;
};

class History : public std::enable_shared_from_this<History> {
 public:
  /// `log`: connection for long requests. `folder`: of the store; empty: no store. `disk`: its thread.
  History(boost::asio::io_context& io, DiskThread& disk, client::Client& log, std::string axis, std::string folder);

  /// Reads the log into the store, until the context ends. Call once.
  boost::asio::awaitable<void> follow();
  /// Call when prismd is connected: loads the seconds of the last hour.
  boost::asio::awaitable<void> load();
  /// Adds the second of a window notification.
  void window(const nlohmann::json& params);

  /// The method `range` (docs/protocol.md). Returns a member of the response.
  boost::asio::awaitable<std::string> range(nlohmann::json params);

 private:
  struct View;
  struct Page;
  template <class T>
  boost::asio::awaitable<Result<T>> on_disk(std::function<Result<T>(PeriodStore&)> work, bool is_query);
  boost::asio::awaitable<std::chrono::milliseconds> read_page();
  boost::asio::awaitable<tl::expected<Page, client::RequestError>> page_after(std::string cursor);
  boost::asio::awaitable<Result<std::vector<Period>>> seconds_of_log(View view);
  void take_status(const PeriodStore::Status& status);
  bool is_stored() const { return has_log_ && status_.is_open; }
  std::optional<double> building() const;
  std::optional<View> view_of(const nlohmann::json& params) const;
  std::string result_of(const View& view, const std::vector<Period>& periods) const;

  boost::asio::io_context& io_;
  DiskThread& disk_;
  client::Client& log_;
  const std::string axis_;
  RecentSeconds recent_;
  std::shared_ptr<PeriodStore> store_;  ///< used by the disk's thread only; null: none
  PeriodStore::Status status_;          ///< of the store after its last change
  Turns log_turns_, store_turns_;       ///< the intermediate results of a request are larger than its response
  bool has_log_ = true, is_behind_ = true;
  int uncommitted_pages_ = 0;
  double fraction_ = 0;  ///< of the log's rows that the store has
};

}  // namespace prism::prismweb
