// SPDX-License-Identifier: MIT
// History of one axis: the last two hours in memory, minutes and hours in an SQLite file, seconds in prismd's log.
#pragma once

#include <array>
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
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/disk_thread.hpp"
#include "compensation/compensated.hpp"
#include "tools/client/client.hpp"

struct sqlite3;

namespace prism::prismweb {

/// Columns of a period and of the store. `range` returns the sums of rate and corrected rate as means.
enum Column : std::size_t {
  kRateMin,
  kRateMax,
  kCorrectedMin,
  kCorrectedMax,
  kBiasMin,
  kBiasMax,
  kSdMax,
  kTemperatureMin,
  kTemperatureMax,
  kSlopeMin,
  kSlopeMax,
  kUhfoMin,
  kUhfoMax,
  kRateSum,
  kCorrectedSum,
  kSamples,
  kMissing,
  kSeconds,
  kGood,
  kRateKnown,
  kCorrectedKnown,
  kColumns
};
inline constexpr std::array<std::string_view, kColumns> kColumnNames = {
    "rate_min", "rate_max",        "corrected_min",   "corrected_max", "bias_min",  "bias_max",
    "sd_max",   "temperature_min", "temperature_max", "slope_min",     "slope_max", "uhfo_min",
    "uhfo_max", "rate_sum",        "corrected_sum",   "samples",       "missing",   "seconds",
    "good",     "rate_known",      "corrected_known"};

/// Summary of one or more seconds: deg/h, degC, degC/s, V, counts. A minimum or maximum is NaN if no second has the
/// value.
struct Period {
  std::int64_t begin_s = 0;  ///< time of the data; the log row with time_s = t begins at t - 1
  std::array<double, kColumns> values{};
  std::map<std::string, std::array<double, 2>> sensors = {};  ///< minimum and maximum of other sensors

  /// Adds another period. begin_s does not change.
  void add(const Period& other);
};

/// Converts a row of the log.
Period second_of(const compensation::CompensatedWindow& row);
/// Converts the params of a window notification. Returns nullopt if they have no valid time_s.
std::optional<Period> second_of(const nlohmann::json& window);

/// Rounds down to a multiple of `length_s`.
std::int64_t floor_to(std::int64_t time_s, std::int64_t length_s);

/// Returns the shortest step of the list in docs/protocol.md that is at least `min_s` and gives at most `points` steps
/// in `length_s`. If the longest is too short, returns a number of days.
std::int64_t step_for(double length_s, int points, std::int64_t min_s);

/// Joins the periods that begin within [from_s, to_s) to steps, in order of time.
std::vector<Period> downsample(std::span<const Period> periods, std::int64_t from_s, std::int64_t to_s,
                               std::int64_t step_s);

/// `periods.sqlite` in a directory (docs/protocol.md, "The store"). Everything in it can be read from the log again: a
/// file that is damaged in any way is deleted, and the store is then empty. Not thread-safe, but may be used by another
/// thread than the one that made it.
class PeriodStore {
 public:
  struct Status {
    std::string cursor;                           ///< after the last row included; empty: read the log from the start
    std::optional<std::int64_t> first_s, last_s;  ///< first and last second, in the order of the log
    std::string problem;  ///< why the store cannot be opened or written, or is filled again; empty: none
    bool is_open = false;
  };
  struct Periods {
    std::vector<Period> steps;
    std::optional<std::int64_t> last_s;  ///< last second in the store
  };
  using Cursors = std::vector<std::pair<std::int64_t, std::string>>;  ///< second, and a cursor before its rows

  explicit PeriodStore(std::string folder) : folder_(std::move(folder)) {}

  /// Opens the store, or creates it. Checks all of it, and deletes a damaged one. Locks it until the destruction.
  const Status& open();
  /// Adds seconds in log order, between the cursors `from` and `to`. They are on disk after a call with `commit`; a
  /// store that is closed before, or has an error, is as after the last one. No effect if the store is not open, or not
  /// at `from`.
  const Status& add(const std::string& from, std::span<const Period> seconds, const std::string& to, bool commit);
  /// Deletes everything, for a replaced log.
  const Status& clear();
  /// After the last operation.
  const Status& status() const { return status_; }

  /// Returns the steps that begin within [from_s, to_s); `step_s`: a multiple of 60. Errors: the disk cannot be read,
  /// or the store was damaged and is now empty.
  Result<Periods> periods(std::int64_t from_s, std::int64_t to_s, std::int64_t step_s);
  /// Returns the last known cursor before the rows of `second`; one per run of the gyro's clock, the last run first.
  Result<Cursors> cursors_before(std::int64_t second);

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  class Statement;

  void load();
  void check();
  void create();
  void read_state();
  void write(std::span<const Period> seconds, const std::string& cursor);
  void write_cursor(std::int64_t next_s, const std::string& cursor);
  void remove_files();
  bool refill_if_damaged();
  void run(const std::string& sql);
  std::string value(const std::string& sql);
  void fail();
  void fail(const std::string& what, bool is_damage);
  template <class T, class Take>
  Result<T> query(const std::string& sql, const std::vector<std::int64_t>& values, T found, Take take);

  std::string folder_, path_;
  std::unique_ptr<sqlite3, Close> database_;
  Status status_;
  std::optional<Error> error_;  ///< the first of the current operation, whose further steps have no effect
  bool is_damaged_ = false;
};

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
