// SPDX-License-Identifier: MIT
// A recording: a stream of one-second means from a log of prismd, a capture, or any CSV with mapped columns.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "compensation/second_averager.hpp"
#include "tools/prismcal/findings.hpp"
#include "tools/prismcal/plain_table.hpp"

namespace prism::recordings {

struct SourceFile {
  std::string path, sha256;
  std::size_t rows = 0;
};

/// The "# key: value" lines of a log; the first with the key wins.
struct Metadata {
  std::map<std::string, std::string> metadata;

  std::string value(const std::string& key) const;  ///< empty: none
  /// Returns nullopt for another line.
  std::optional<std::pair<std::string_view, std::string_view>> add(std::string_view line);
};

struct Recording : Metadata {
  std::string name;  ///< name of the file or folder, without directory and extension
  std::vector<SourceFile> files;
  std::size_t seconds = 0;                       ///< rows, also partial ones
  bool is_date = false;                          ///< the seconds count from 1970
  SensorList sensor_list;                        ///< of the first second; null: no sensors
  std::map<std::uint32_t, std::size_t> samples;  ///< seconds by their number of samples
  std::vector<Finding> findings;                 ///< complete after the last second
  std::vector<std::string> unmatched;            ///< ranges of SourceOptions::leave_out without a second of it

  /// Sensors whose values the seconds contain; empty if there are no seconds.
  std::vector<SensorName> sensors() const;
  std::vector<std::string> remarks() const { return lines_of(findings, Severity::kRemark); }
  std::vector<std::string> questions() const { return lines_of(findings, Severity::kQuestion); }
};

struct SourceOptions {
  /// "rate=COLUMN:UNIT", "temperature=…", "uhfo=…", "time=…". COLUMN: name or number from 1. UNIT: see
  /// ../tables/units.hpp, else by the header; "rate=Gx:deg/s*0.061-1.2" scales and shifts a column to its unit. Empty:
  /// not a mapped CSV.
  std::vector<std::string> map;
  tables::TableOptions table;  ///< how a mapped table is written; its interval_s: spacing of rows without a time, > 0
  bool judged = true;          ///< mapped table: implausible values and outliers are left out (findings.hpp)
  std::string config;          ///< capture: configuration of the prismd that recorded it
  std::string axis;            ///< selects one axis of a log or capture with several
  std::vector<std::string> leave_out;  ///< times that are not used: see LeaveOut
};

struct SiteOptions {
  std::optional<double> latitude_deg, elevation_deg, azimuth_deg;  ///< override the site in the recording
  bool no_earth_rate = false;
  bool accept_unit = false;  ///< also if the mean rate is the Earth rate in another unit
};

/// Called with each second of a recording in order; seconds increase within a session. The recording has its name,
/// metadata and sensors. Errors end the reading.
using OnSecond = std::function<Result<void>(const Recording& recording, const compensation::SecondMean& second_mean,
                                            bool begins_session)>;

/// Filled by each reader: passes the seconds that are not left out to a consumer, counts them in the recording, and
/// finds jumps.
class SecondFeed {
 public:
  SecondFeed(const std::string& path, LeaveOut leave_out, const OnSecond& on_second);

  Recording& recording() { return recording_; }
  LeaveOut& leave_out() { return leave_out_; }
  Result<void> push(const compensation::SecondMean& second_mean, bool begins_session);
  /// Adds the findings to the recording.
  void finish();

 private:
  Recording recording_;
  LeaveOut leave_out_;
  const OnSecond& on_second_;
  JumpFinder jumps_;
  bool session_begins_ = false;  ///< its first seconds were left out
};

// Files with the bytes of a line, which need a frame description.

/// Returns true if the first bytes are those of pcap or pcapng.
bool is_capture(const std::string& path);

/// "capture", "file of bytes" (binary) or "log of sentences"; empty: probably a table. Reads the first bytes.
/// Errors: those of FileReader::open(); a damaged container (MATLAB); a text that shows bytes (has_sentences()).
Result<std::string> bytes_kind(const std::string& path);

/// Reads a mapped CSV if options.map is not empty, else a capture or a log by the first bytes of the file, as a stream
/// of seconds. Errors: also those of `on_second`.
Result<Recording> read_recording(const std::string& path, const SourceOptions& options, const OnSecond& on_second);

/// Finds ranges of --leave-out that contain no second of any of several recordings.
class UnmatchedRanges {
 public:
  explicit UnmatchedRanges(std::vector<std::string> ranges) : ranges_(std::move(ranges)) {}
  void add(const Recording& recording);
  Result<void> finish() const;  ///< Errors: there is one.

 private:
  std::vector<std::string> ranges_;
};

/// Returns the axes to choose from: those in the headers of the logs, or those in the configuration of a capture. Reads
/// no rows.
Result<std::vector<std::string>> axes_of(const std::string& path, const SourceOptions& options);

/// The Earth rate on the input axis, deg/h, by the options or the recording's "site"; 0 with --no-earth-rate. Errors:
/// no site in either; no azimuth that matters.
Result<double> earth_rate_of(const Recording& recording, const SiteOptions& options);

// The readers in other source files.
/// Returns true for the first bytes of a log, also if a power failure truncated them, or if one of them is damaged. An
/// empty or truncated *.csv is a log: prismd was stopped before its first row.
bool begins_a_log(const std::string& path);

std::vector<std::string> axes_of_log(const std::string& path);
/// The place of the wanted axis, or of the only one. Errors: several without a choice, or none of this name.
Result<std::size_t> choose_axis(const std::vector<std::string>& names, const std::string& wanted,
                                const std::string& where);
/// Reads a log file of prismd, or all *.csv of a folder. Errors: those of LogFolder::open().
Result<void> read_log(const std::string& path, const SourceOptions& options, SecondFeed& feed);
/// Averages the rows to seconds with SecondAverager, as prismd does.
Result<void> read_mapped(const std::string& path, const SourceOptions& options, SecondFeed& feed);

// A table that is not mapped.

/// The site in the command lines, which no table states.
inline constexpr const char* kSiteAdvice =
    "DEG: latitude of the site, elevation of the gyro's input axis above the horizon; for rates already corrected for "
    "the Earth rate: --no-earth-rate instead";

/// The first column with the unit of a rate.
std::optional<std::size_t> rate_column(const tables::PlainTable& table);

/// The entries of --map that read these columns, by their units and names; with words in capitals for what no column
/// states. Of several columns that may be a quantity it takes the first.
std::vector<std::string> suggested_map(const tables::PlainTable& table, const tables::TableOptions& options);

/// "prismcal train FILE --map … --latitude DEG --elevation DEG --inputs T,dTdt --out model.json": the command line by
/// the units and names of the columns, with the stated options. "rate=COLUMN:UNIT": no column states it.
std::string train_command(const tables::PlainTable& table, const tables::TableOptions& options);

// One column of a log or table as an evenly spaced rate, for an Allan deviation.

struct RateSeriesChoice {
  std::string column;          ///< name, or number from 1; empty: "rate_deg_per_h", or the only column except the time
  std::string time_column;     ///< name or number; empty: the column whose name and unit are those of a time
  std::string unit;            ///< deg/h, deg/s, rad/s, arcsec/s; empty: by the column's header
  std::string axis;            ///< selects one axis of a log with several
  tables::TableOptions table;  ///< how a table of another program is written; its interval_s overrides the time column
};

struct RateSeries {
  std::string column;
  /// NaN for each missing value: an empty field, or a jump in time; evaluation::kAllanBreak between two records:
  /// sessions, or rows before and after a long gap.
  std::vector<double> rate_deg_per_h;
  double interval_s = 1;
  std::string
      interval_source;  ///< how it was found: "median step of time_s", "given", "assumed: …"; printed in reports
  std::size_t rows = 0;
  std::string gyro_serial;              ///< of a log; empty: unknown
  std::optional<std::int64_t> begin_s;  ///< since 1970; nullopt: no date
  std::vector<std::string> notes;       ///< readable lines on rows left out, and on the time
};

/// Reads prismd's log, a file or a folder (log_folder.hpp), if no time column or interval is given. Otherwise a table
/// of another program; sample_grid() decides the interval and the gaps. Errors, with file
/// and line: those of PlainTable, an unknown column, a unit that is not one of a rate, time that goes back, no row.
Result<RateSeries> read_rate_series(const std::string& path, const RateSeriesChoice& choice);

}  // namespace prism::recordings
