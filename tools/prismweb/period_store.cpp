// SPDX-License-Identifier: MIT
#include "tools/prismweb/period_store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>
#include <tuple>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_member.hpp"
#include "compensation/compensated_text.hpp"

namespace prism::prismweb {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::array<std::int64_t, 18> kSteps = {1,   2,   5,    10,   15,   30,    60,    120,   300,
                                                 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400};

// A quantity of a second: its name in the log and in JSON, and its first column.
struct Quantity {
  std::string_view name;
  Column column;
};
constexpr std::array<Quantity, 7> kQuantities = {{{"rate_deg_per_h", kRateMin},
                                                  {"corrected_deg_per_h", kCorrectedMin},
                                                  {"bias_deg_per_h", kBiasMin},
                                                  {"sd_deg_per_h", kSdMax},
                                                  {"temperature_degc", kTemperatureMin},
                                                  {"slope_degc_per_s", kSlopeMin},
                                                  {"uhfo_v", kUhfoMin}}};

// `value_of`: returns the value of a quantity.
template <class ValueOf>
Period period_of(std::int64_t begin_s, double samples, double missing, bool is_good, const ValueOf& value_of) {
  Period second{begin_s, {}};
  auto& values = second.values;
  for (const auto& [name, column] : kQuantities) {
    values[column] = value_of(name);
    if (column != kSdMax) values[column + 1] = values[column];  // minimum and maximum
  }
  for (const auto& [value, sum, known] :
       {std::tuple(kRateMin, kRateSum, kRateKnown), std::tuple(kCorrectedMin, kCorrectedSum, kCorrectedKnown)}) {
    if (std::isnan(values[value])) continue;
    values[sum] = values[value];
    values[known] = 1;
  }
  values[kSamples] = samples;
  values[kMissing] = missing;
  values[kSeconds] = 1;
  values[kGood] = is_good ? 1 : 0;
  return second;
}

constexpr std::int64_t kStoreVersion = 5, kCursorInterval_s = 3 * 3600;
// The first three are of prismweb 0.2.
constexpr std::array<const char*, 5> kOldFiles = {"place.json", "minutes", "hours", "periods.sqlite-wal",
                                                  "periods.sqlite"};

struct Table {
  const char* name;
  std::int64_t length_s;
};
constexpr Table kMinutes{"minutes", 60}, kHours{"hours", 3600};

std::string create_sql(const Table& table) {
  return fmt::format("CREATE TABLE {} (begin_s INTEGER PRIMARY KEY, {} REAL, sensors TEXT)", table.name,
                     fmt::join(kColumnNames, " REAL, "));
}

}  // namespace

// fmin and fmax ignore NaN.
void Period::add(const Period& other) {
  for (std::size_t i = 0; i < kColumns; ++i) {
    const std::string_view name = kColumnNames[i];
    const double before = values[i], more = other.values[i];
    values[i] = name.ends_with("_min")   ? std::fmin(before, more)
                : name.ends_with("_max") ? std::fmax(before, more)
                                         : before + more;
  }
  for (const auto& [name, range] : other.sensors) {
    auto& [min, max] = sensors.try_emplace(name, range).first->second;
    min = std::min(min, range[0]);
    max = std::max(max, range[1]);
  }
}

Period second_of(const compensation::CompensatedWindow& row) {
  const compensation::SecondMean& mean = row.window.second_mean;
  const auto value_of = [&](std::string_view name) {
    return compensation::kLogColumns[compensation::column_index(name)].value(row);
  };
  Period second = period_of(mean.second, static_cast<double>(mean.samples), static_cast<double>(mean.missing_frames),
                            row.correction.quality == compensation::kGood, value_of);
  for (std::size_t i = 0; i < mean.sensors.size(); ++i) {
    const double value = mean.sensors[i];
    if (!std::isnan(value)) second.sensors[(*mean.sensor_list)[i].name] = {value, value};
  }
  return second;
}

std::optional<Period> second_of(const json& window) {
  const auto value_of = [&](std::string_view name) { return number_member(window, name, kUnknown); };
  const double end_s = value_of("time_s");
  if (!(std::fabs(end_s) < 1e10)) return std::nullopt;
  Period second = period_of(std::llround(end_s) - 1, static_cast<double>(count_member(window, "samples")),
                            static_cast<double>(count_member(window, "missing")),
                            text_member(window, "quality") == "good", value_of);
  for (const auto& [name, value] : member(window, "sensors").items())
    if (value.is_number()) second.sensors[name] = {value, value};
  return second;
}

std::int64_t floor_to(std::int64_t time_s, std::int64_t length_s) {
  const std::int64_t rest = time_s % length_s;
  return time_s - (rest < 0 ? rest + length_s : rest);
}

// Plus 1, because the limits of the range may cut two steps.
std::int64_t step_for(double length_s, int points, std::int64_t min_s) {
  const auto fits = [&](std::int64_t step) {
    return step >= min_s && length_s / static_cast<double>(step) + 1 <= std::max(points, 2);
  };
  const auto found = std::find_if(kSteps.begin(), kSteps.end(), fits);
  if (found != kSteps.end()) return *found;
  return kSteps.back() *
         static_cast<std::int64_t>(std::ceil(length_s / static_cast<double>(kSteps.back()) / std::max(points - 1, 1)));
}

// A map, because times repeat after a reset of the gyro's clock.
std::vector<Period> downsample(std::span<const Period> periods, std::int64_t from_s, std::int64_t to_s,
                               std::int64_t step_s) {
  std::map<std::int64_t, Period> steps;
  for (const Period& period : periods) {
    if (period.begin_s < from_s || period.begin_s >= to_s) continue;
    const std::int64_t begin_s = floor_to(period.begin_s, step_s);
    const auto [step, is_new] = steps.try_emplace(begin_s, period);
    if (is_new) {
      step->second.begin_s = begin_s;
    } else {
      step->second.add(period);
    }
  }
  std::vector<Period> all;
  for (const auto& [begin_s, step] : steps) all.push_back(step);
  return all;
}

void PeriodStore::Close::operator()(sqlite3* database) const { sqlite3_close_v2(database); }

class PeriodStore::Statement {
 public:
  Statement(PeriodStore& store, const std::string& sql) : store_(store) {
    if (!store.error_) check(sqlite3_prepare_v2(store.database_.get(), sql.c_str(), -1, &statement_, nullptr));
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(std::int64_t value) { check(sqlite3_bind_int64(statement_, ++count_, value)); }
  void bind(double value) { check(sqlite3_bind_double(statement_, ++count_, value)); }  // NaN: NULL
  void bind(const std::string& value) {
    check(sqlite3_bind_text(statement_, ++count_, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT));
  }
  /// False at the end and after an error.
  bool next() {
    const int code = store_.error_ ? SQLITE_DONE : sqlite3_step(statement_);
    if (code != SQLITE_DONE) check(code);
    return code == SQLITE_ROW;
  }
  void run_again() {
    while (next()) {
    }
    sqlite3_reset(statement_);
    count_ = 0;
  }

  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_, column); }
  double number(int column) const {
    const bool is_known = sqlite3_column_type(statement_, column) != SQLITE_NULL;
    return is_known ? sqlite3_column_double(statement_, column) : kUnknown;
  }
  std::string text(int column) const {
    const auto* const text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return text == nullptr ? "" : text;
  }
  /// The row of a table of periods.
  Period period() const {
    Period period{integer(0), {}};
    for (std::size_t i = 0; i < kColumns; ++i) period.values[i] = number(static_cast<int>(i) + 1);
    if (const std::string sensors = text(kColumns + 1); !sensors.empty()) {
      try {
        period.sensors = json::parse(sensors).get<decltype(period.sensors)>();
      } catch (const json::exception& error) {
        store_.fail(error.what(), true);
      }
    }
    return period;
  }

 private:
  void check(int code) {
    if (code != SQLITE_OK && code != SQLITE_ROW) store_.fail();
  }

  PeriodStore& store_;
  sqlite3_stmt* statement_ = nullptr;
  int count_ = 0;
};

void PeriodStore::run(const std::string& sql) { Statement(*this, sql).run_again(); }

std::string PeriodStore::value(const std::string& sql) {
  Statement statement(*this, sql);
  return statement.next() ? statement.text(0) : "";
}

// After an error that is not of the disk or of another process, the file is not as it was written.
void PeriodStore::fail() {
  const int code = sqlite3_errcode(database_.get()), reason = sqlite3_system_errno(database_.get());
  if (code == SQLITE_BUSY) return fail("is in use by another process", false);
  if (code == SQLITE_FULL) return fail(std::strerror(ENOSPC), false);
  const bool by_disk = code == SQLITE_IOERR || code == SQLITE_CANTOPEN;
  fail(by_disk && reason != 0 ? std::strerror(reason) : sqlite3_errmsg(database_.get()),
       !by_disk && code != SQLITE_NOMEM);
}

void PeriodStore::fail(const std::string& what, bool is_damage) {
  if (error_) return;
  error_ = Error{path_, what};
  is_damaged_ = is_damage;
}

const PeriodStore::Status& PeriodStore::open() {
  load();
  if (!refill_if_damaged()) status_.problem = error_ ? std::exchange(error_, std::nullopt)->text() : "";
  return status_;
}

const PeriodStore::Status& PeriodStore::clear() {
  remove_files();
  return open();
}

// Deletes a damaged store and starts an empty one.
bool PeriodStore::refill_if_damaged() {
  if (!error_ || !std::exchange(is_damaged_, false)) return false;
  const std::string why = std::exchange(error_, std::nullopt)->text() + "; filling it again from the log";
  remove_files();
  load();
  status_.problem = error_ ? std::exchange(error_, std::nullopt)->text() : why;
  return true;
}

void PeriodStore::remove_files() {
  database_.reset();
  status_ = {};
  for (const char* const name : kOldFiles) {
    std::error_code error;
    fs::remove(fs::path(folder_) / name, error);
    if (error) fail(error.message(), false);
  }
}

// Creates the files, because SQLite reports "No such file" for one that it cannot create, whatever the reason. With an
// exclusive lock, the write-ahead log needs no shared memory, and two processes cannot count the same rows.
void PeriodStore::load() {
  std::error_code error;
  fs::create_directories(folder_, error);
  const fs::path folder = error ? fs::path(folder_) : fs::canonical(folder_, error);  // NOFOLLOW rejects links
  path_ = (folder / "periods.sqlite").string();
  if (error) return fail(error.message(), false);
  for (const std::string& path : {path_, path_ + "-wal"}) {
    const Descriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644));
    if (file.get() < 0) return fail(std::strerror(errno), false);
  }
  sqlite3* opened = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOFOLLOW | SQLITE_OPEN_NOMUTEX;
  const int code = sqlite3_open_v2(path_.c_str(), &opened, flags, nullptr);
  database_.reset(opened);
  if (code != SQLITE_OK) return fail();
  for (const char* const setting : {"locking_mode = EXCLUSIVE", "journal_mode = WAL", "wal_autocheckpoint = 100",
                                    "cache_size = -256", "trusted_schema = OFF"})
    run(std::string("PRAGMA ") + setting);
  check();
  read_state();
  if (error_) database_.reset();
}

// Also compares the number of seconds, so that missing rows are noticed.
void PeriodStore::check() {
  const std::string integrity = value("PRAGMA integrity_check(1)"), version = value("PRAGMA user_version");
  if (error_) return;
  if (integrity != "ok")  // the first line only names the database
    return fail("found damage: " + integrity.substr(integrity.rfind('\n') + 1), true);
  if (value("SELECT count(*) FROM sqlite_schema") == "0") return create();
  if (version != std::to_string(kStoreVersion)) return fail("found version " + version, true);
  const std::string seconds = value("SELECT seconds FROM state");
  for (const Table& table : {kMinutes, kHours}) {
    const std::string found = value(fmt::format("SELECT CAST(total(seconds) AS INTEGER) FROM {}", table.name));
    if (found != seconds) fail(fmt::format("found {} seconds in {}, expected {}", found, table.name, seconds), true);
  }
}

void PeriodStore::create() {
  run("BEGIN");
  for (const Table& table : {kMinutes, kHours}) run(create_sql(table));
  run("CREATE TABLE cursors (id INTEGER PRIMARY KEY, begin_s INTEGER, cursor TEXT)");
  run("CREATE TABLE state (cursor TEXT, first_s INTEGER, last_s INTEGER, seconds INTEGER)");
  run("INSERT INTO state VALUES ('', NULL, NULL, 0)");
  run(fmt::format("PRAGMA user_version = {}", kStoreVersion));
  run("COMMIT");
}

void PeriodStore::read_state() {
  Statement state(*this, "SELECT cursor, first_s, last_s FROM state");
  status_ = {};
  if (!state.next()) return;
  status_.is_open = true;
  status_.cursor = state.text(0);
  if (std::isnan(state.number(1))) return;  // no second yet
  status_.first_s = state.integer(1);
  status_.last_s = state.integer(2);
}

const PeriodStore::Status& PeriodStore::add(const std::string& from, std::span<const Period> seconds,
                                            const std::string& to, bool commit) {
  if (!status_.is_open || from != status_.cursor) return status_;
  const auto is_in_transaction = [&] { return sqlite3_get_autocommit(database_.get()) == 0; };
  if (!is_in_transaction()) run("BEGIN");
  write(seconds, to);
  if (commit) run("COMMIT");
  if (refill_if_damaged()) return status_;
  const std::optional<Error> error = std::exchange(error_, std::nullopt);
  if (error && is_in_transaction()) run("ROLLBACK");
  const std::string problem = error ? error->text() : commit ? "" : status_.problem;  // a later commit may fail
  read_state();
  error_.reset();
  status_.problem = problem;
  return status_;
}

void PeriodStore::write(std::span<const Period> seconds, const std::string& cursor) {
  const std::vector<const char*> places(kColumns + 2, "?");
  for (const Table& table : {kMinutes, kHours}) {
    Statement select(*this, fmt::format("SELECT * FROM {} WHERE begin_s = ?", table.name));
    Statement insert(*this, fmt::format("INSERT OR REPLACE INTO {} VALUES ({})", table.name, fmt::join(places, ", ")));
    for (Period& period : downsample(seconds, INT64_MIN, INT64_MAX, table.length_s)) {
      select.bind(period.begin_s);
      if (select.next()) period.add(select.period());
      select.run_again();
      insert.bind(period.begin_s);
      for (const double value : period.values) insert.bind(value);
      insert.bind(period.sensors.empty() ? "" : json_text(json(period.sensors)));
      insert.run_again();
    }
  }
  Statement state(*this, "UPDATE state SET cursor = ?, seconds = seconds + ?");
  state.bind(cursor);
  state.bind(static_cast<std::int64_t>(seconds.size()));
  state.run_again();
  if (seconds.empty()) return;
  Statement limits(*this, "UPDATE state SET first_s = ifnull(first_s, ?), last_s = ?");
  limits.bind(seconds.front().begin_s);
  limits.bind(seconds.back().begin_s);
  limits.run_again();
  write_cursor(seconds.back().begin_s + 1, cursor);
}

// A cursor every 3 h finds old seconds in the log. The row after `cursor` follows the last second.
void PeriodStore::write_cursor(std::int64_t next_s, const std::string& cursor) {
  Statement last(*this, "SELECT begin_s FROM cursors ORDER BY id DESC LIMIT 1");
  const std::int64_t passed_s = last.next() ? next_s - last.integer(0) : kCursorInterval_s;
  if (passed_s >= 0 && passed_s < kCursorInterval_s) return;
  Statement insert(*this, "INSERT INTO cursors VALUES (NULL, ?, ?)");
  insert.bind(next_s);
  insert.bind(cursor);
  insert.run_again();
}

// A statement must end before its database is closed.
template <class T, class Take>
Result<T> PeriodStore::query(const std::string& sql, const std::vector<std::int64_t>& values, T found, Take take) {
  {
    Statement select(*this, sql);
    for (const std::int64_t value : values) select.bind(value);
    while (select.next()) take(select, found);
  }
  if (!error_) return found;
  const Error error = *error_;
  if (!refill_if_damaged()) error_.reset();
  return tl::unexpected<Error>(error);
}

Result<PeriodStore::Periods> PeriodStore::periods(std::int64_t from_s, std::int64_t to_s, std::int64_t step_s) {
  const Table& table = step_s % kHours.length_s == 0 ? kHours : kMinutes;
  const auto take = [&](const Statement& row, Periods& found) {
    Period period = row.period();
    period.begin_s = floor_to(period.begin_s, step_s);
    const bool is_new = found.steps.empty() || found.steps.back().begin_s != period.begin_s;
    if (is_new) found.steps.push_back(period);
    if (!is_new) found.steps.back().add(period);
  };
  const std::string sql = "SELECT * FROM {} WHERE begin_s >= ? AND begin_s < ? ORDER BY begin_s";
  return query(fmt::format(fmt::runtime(sql), table.name), {from_s, to_s}, Periods{{}, status_.last_s}, take);
}

Result<PeriodStore::Cursors> PeriodStore::cursors_before(std::int64_t second) {
  std::int64_t later_s = INT64_MAX;  // of the cursor after this one
  bool has_cursor = false;           // of this run of the clock
  const auto take = [&](const Statement& row, Cursors& found) {
    const std::int64_t begin_s = row.integer(0);
    has_cursor = has_cursor && begin_s < later_s;
    later_s = begin_s;
    if (has_cursor || begin_s > second) return;
    found.emplace_back(begin_s, row.text(1));
    has_cursor = true;
  };
  return query("SELECT begin_s, cursor FROM cursors ORDER BY id DESC", {}, Cursors(), take);
}

}  // namespace prism::prismweb
