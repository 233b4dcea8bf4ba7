// SPDX-License-Identifier: MIT
// Summaries of seconds for charts, and their store: minutes and hours of one axis in an SQLite file.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "compensation/compensated.hpp"

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

}  // namespace prism::prismweb
