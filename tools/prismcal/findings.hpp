// SPDX-License-Identifier: MIT
// The findings of a recording: values that are doubtful, in one list for inspect, train, evaluate, compare and allan.
// Values that are not used are left out here: because of a finding, which names them, or by --leave-out.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/plausibility.hpp"
#include "compensation/second_averager.hpp"
#include "tools/prismcal/series.hpp"

namespace prism::recordings {

enum class Severity {
  kRemark,    ///< on the times, or values that are not used
  kQuestion,  ///< a fault, or true; the values are used
};

struct Finding {
  std::string kind;  ///< far, constant, implausible, jump, sign, left out, absent, time, step, file, configuration
  std::string text;  ///< one line; empty: counted by the one before it
  Severity severity = Severity::kRemark;
  std::string advice = {};          ///< what to do, a sentence; empty: nothing
  std::int64_t begin = 0, end = 0;  ///< first and last second, or row, with a value of it; 0: of all

  std::string line() const { return advice.empty() ? text : text + " " + advice; }
};

/// Appends a finding of each text that is not empty.
void add_remarks(std::vector<Finding>& findings, const std::string& kind, const std::vector<std::string>& texts);

/// The lines of the findings with this severity.
std::vector<std::string> lines_of(const std::vector<Finding>& findings, Severity severity);

// Values without information.

/// Makes values without information unknown, in each quantity: those far from all others (the rate by 50 times the
/// noise in at most 600 s and 5 % of the recording, or by 60 deg/h, which no turn of the gyro at rest explains; other
/// quantities if constant or absurd), for at most half of the recording; at most five runs, or any number with one
/// value, which may be nearer (8 times the noise). Then constant ones for which the source must have stopped. Values
/// after them that were rejected because they returned too fast are valid again. `is_date`: as end_of_second(). Returns
/// the findings of each quantity: rate, temperature, uhfo.
std::array<std::vector<Finding>, 3> judge_seconds(std::vector<compensation::SecondMean>& second_means, bool is_date);

/// Rows of a table, for their rate.
struct RateRows {
  double unit_deg_per_h = 1;  ///< of a value of 1
  double interval_s = 1;      ///< about, between two rows
  /// In ns; empty: without. Their number is that of the rows.
  std::span<const std::int64_t> stamps_ns = {};
  bool is_date = false;
};

/// The same for the rates of a table, row by row.
std::vector<Finding> judge_rates(std::vector<double>& rates, const RateRows& rows);

/// Judges the rows of a table before they are averaged. Call push() with each row in order of time, then finish().
class RowJudge {
 public:
  /// Returns the implausible quantities of the sample, by the same limits as for a line, and counts them.
  QuantitySet push(const Sample& sample, std::size_t line);
  /// The findings, with those of judge_seconds(), which explain values that are not counted here. Errors: more than 1 %
  /// of a quantity is implausible.
  Result<std::vector<Finding>> finish(const std::string& path,
                                      const std::array<std::vector<Finding>, 3>& of_seconds) const;

 private:
  /// The rejected values of one second.
  struct Rejected {
    std::int64_t second = 0;
    std::size_t values = 0, first_line = 0;
    compensation::Rejection why = {};  ///< of the first
  };
  struct Count {
    std::size_t values = 0, like_kelvin = 0;
    std::vector<Rejected> rejected = {};
  };

  compensation::Plausibility plausibility_{compensation::PlausibilityLimits{}};
  std::array<Count, 3> counts_;
};

/// The step to which a rate was rounded, if it exceeds the noise, so that means show no smaller changes: the usual
/// difference between successive runs of three or more equal values, if most values are in such runs. 0: the noise is
/// larger than the step, or the rate stops too rarely to tell.
double rounding_step(const std::vector<Series>& rates);

// Jumps that stay.

/// Finds jumps of a recording's temperature that stay, faults of the thermometer or true, from one-second means, as
/// prismd reports of its line (daemon/pipeline/stream_watch.hpp).
class JumpFinder {
 public:
  /// Call with each second in order.
  void push(const compensation::SecondMean& second_mean, bool begins_session);
  /// One question per jump, with the --leave-out that leaves it out. `is_date`: as end_of_second().
  std::vector<Finding> findings(bool is_date) const;

 private:
  struct Jump {
    compensation::JumpWatch::Jump values;
    std::int64_t from = 0;           ///< its first second
    std::optional<std::int64_t> to;  ///< the last second before it had jumped back
  };
  compensation::JumpWatch watch_;
  double last_degc_ = kUnknown;        ///< plausible
  std::int64_t from_ = 0, until_ = 0;  ///< seconds that are rejected
  std::vector<Jump> jumps_;
};

// The mean of a recording against the Earth rate of its site; both in deg/h, the mean with the Earth rate.

/// The unit in which the mean rate would be the Earth rate (within 30 %), if it is not in the stated one: "rad/s" of
/// values that were taken for deg/h, "deg/h" of values that were taken for another unit. Returns nullopt if the mean is
/// plausible, no other unit fits either, or the Earth rate is unknown or below 0.5 deg/h.
std::optional<std::string> likely_unit(double mean_deg_per_h, double earth_rate_deg_per_h);

/// Errors: the mean rate is the Earth rate in another unit, or above 5 deg/s. `name`: of the recording.
Result<void> check_unit(double mean_deg_per_h, double earth_rate_deg_per_h, const std::string& name);

/// A question if the mean rate is the Earth rate with the other sign (within 10 %).
std::optional<Finding> sign_question(double mean_deg_per_h, double earth_rate_deg_per_h);

/// "the rate has 200 of 4320 seconds far from the rest, …" of single seconds, more than judge_seconds() leaves out;
/// empty: none.
std::string spikes_text(const std::vector<Series>& rates);

// Times that are not used (--leave-out).

/// The end of a second as in remarks and as --leave-out reads it: "2026-11-23T09:11:00Z", or "7001 s" without a date.
std::string end_of_second(std::int64_t second, bool is_date);

/// The range of --leave-out that leaves out exactly the seconds `first` to `last`: "7001..7031", or of dates. nullopt:
/// to the end.
std::string leave_out_range(std::int64_t first, std::optional<std::int64_t> last, bool is_date);

/// Ranges "FROM..TO" of times. A time is a date (ISO 8601, UTC without a zone) or a number of seconds: of the table's
/// time, or for recordings with dates since 1970, below 1e8 since the recording's start. An empty end is open.
class LeaveOut {
 public:
  explicit LeaveOut(const std::vector<std::string>& ranges);

  /// Call before contains(), with the first second of the recording; later calls have no effect. Errors: a text that is
  /// not a range, or one that ends before it begins; a date, but the times have none.
  Result<void> begin(std::int64_t first_second, bool is_date);
  /// Returns true if a part of the second (second, second + 1] is in a range, and counts it once. Call in order of
  /// time.
  bool contains(std::int64_t second);
  /// One line per range: the seconds that it left out.
  std::vector<std::string> notes() const;
  /// Texts of the ranges that contain no second of the recording.
  std::vector<std::string> unmatched() const;

 private:
  struct Range {
    std::string text;
    double from_s = 0, to_s = 0;  ///< set by begin()
    std::size_t seconds = 0;
  };

  std::vector<Range> ranges_;
  bool begun_ = false;
  std::optional<std::int64_t> last_;
};

}  // namespace prism::recordings
