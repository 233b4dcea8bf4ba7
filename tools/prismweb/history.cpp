// SPDX-License-Identifier: MIT
#include "tools/prismweb/history.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <exception>
#include <filesystem>
#include <set>
#include <system_error>
#include <tuple>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_member.hpp"
#include "base/time_scale.hpp"
#include "compensation/compensated_text.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using client::error_member;
using client::kUse;
using nlohmann::json;

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

constexpr std::chrono::milliseconds kUpToDate{4000}, kNotConnected{500}, kReopen{30000};
constexpr int kPagesPerCommit = 20;  // while the store is filled
constexpr double kMaxTime_s = 9e9;
constexpr std::int64_t kMaxLogLength_s = 7200, kFar_s = 6 * 3600, kFresh_s = 60;
constexpr std::size_t kMaxRuns = 4;  // of the gyro's clock
constexpr int kMaxPages = 40;        // of up to 256 KiB: covers the range and the interval of stored cursors

// The columns and the rows of a response.
std::pair<json, json> table_of(std::vector<Period> steps, std::int64_t step_s) {
  std::set<std::string> sensors;
  for (const Period& step : steps)
    for (const auto& [name, range] : step.sensors) sensors.insert(name);
  json columns = {"time_s"}, rows = json::array();
  for (std::size_t i = 0; i < kRateKnown; ++i)
    columns.push_back(i == kRateSum ? "rate_mean" : i == kCorrectedSum ? "corrected_mean" : kColumnNames[i]);
  for (const std::string& name : sensors)
    for (const char* const part : {"_min", "_max"}) columns.push_back("sensors." + name + part);
  for (Period& step : steps) {
    step.values[kRateSum] /= step.values[kRateKnown];
    step.values[kCorrectedSum] /= step.values[kCorrectedKnown];
    json row = {step.begin_s + step_s};
    for (std::size_t i = 0; i < kRateKnown; ++i)
      row.push_back(i < kSamples ? json(step.values[i]) : json(static_cast<std::uint32_t>(step.values[i])));
    for (const std::string& name : sensors) {
      const auto found = step.sensors.find(name);
      for (const std::size_t part : {0U, 1U})
        row.push_back(found == step.sensors.end() ? json() : json(found->second[part]));
    }
    rows.push_back(std::move(row));
  }
  return {std::move(columns), std::move(rows)};
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
  const auto value_of = [&](std::string_view name) { return compensation::find_column(name)->value(row); };
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

void RecentSeconds::put(const Period& second) {
  if (now_s_ && second.begin_s > *now_s_) return;
  seconds_.insert_or_assign(second.begin_s, second);
  seconds_.erase(seconds_.begin(), seconds_.upper_bound(last_s() - kLength_s));
}

void RecentSeconds::put_now(const Period& second) {
  if (!empty() && second.begin_s < last_s() - kClockReset_s) seconds_.clear();
  now_s_ = second.begin_s;
  put(second);
}

std::vector<Period> RecentSeconds::after(std::int64_t begin_s) const {
  std::vector<Period> found;
  for (auto at = seconds_.upper_bound(begin_s); at != seconds_.end(); ++at) found.push_back(at->second);
  return found;
}

asio::awaitable<std::shared_ptr<void>> Turns::take() {
  while (running_ >= max_) co_await next_.async_wait(kUse);
  ++running_;
  const auto end = [this](void*) {
    --running_;
    next_.cancel_one();
  };
  co_return std::shared_ptr<void>(nullptr, end);
}

/// A page of prismd's `rows`.
struct History::Page {
  std::string from, after;      ///< cursors before the first and after the last row
  std::vector<Period> seconds;  ///< in log order
  bool more = false;
  std::uint64_t missing = 0;  ///< deleted rows between the cursor and the first row
  double fraction = 1;        ///< of the log's rows, up to this page
};

/// The requested series.
struct History::View {
  std::int64_t from_s, to_s, step_s;  ///< limits of the periods' begins
  int points;
  const char* source;
  std::optional<double> building;  ///< before the rows are read
};

History::History(asio::io_context& io, DiskThread& disk, client::Client& log, std::string axis, std::string folder)
    : io_(io),
      disk_(disk),
      log_(log),
      axis_(std::move(axis)),
      store_(folder.empty() ? nullptr : std::make_shared<PeriodStore>(std::move(folder))),
      log_turns_(io, 2),
      store_turns_(io, 2) {}

// Runs `work` on the disk's thread. A query fails if the disk does not respond in time; the status is taken also later.
template <class T>
asio::awaitable<Result<T>> History::on_disk(std::function<Result<T>(PeriodStore&)> work, bool is_query) {
  struct Pending {
    asio::steady_timer done;
    std::optional<Result<T>> result;
  };
  auto timed_out = make_error("", fmt::format("the disk has not answered for {} s", kDiskTimeout.count()));
  if (is_query && disk_.busy_for() >= kDiskTimeout) co_return timed_out;
  const std::shared_ptr<Pending> pending(new Pending{asio::steady_timer(io_), std::nullopt});
  pending->done.expires_after(is_query ? kDiskTimeout : std::chrono::hours(24 * 365));
  auto task = [pending, weak = weak_from_this(), store = store_, &io = io_, work = std::move(work)] {
    Result<T> result;
    try {
      result = work(*store);
    } catch (const std::exception& error) {
      result = make_error("", error.what());  // out of memory
    }
    asio::post(io, [pending, weak, status = store->status(), result = std::move(result)] {
      if (const auto self = weak.lock()) self->take_status(status);
      pending->result = result;
      pending->done.cancel();
    });
  };
  disk_.post(0, std::move(task));
  co_await pending->done.async_wait(kUse);
  if (!pending->result) co_return timed_out;
  co_return std::move(*pending->result);
}

// Reports a problem once, not at each retry.
void History::take_status(const PeriodStore::Status& status) {
  if (status.problem != status_.problem)
    fmt::print(stderr, "prismweb: {} {}: {}\n", log_.name(), axis_,
               status.problem.empty() ? "minutes and hours are stored again" : status.problem);
  status_ = status;
  if (!status.cursor.empty()) return;
  is_behind_ = true;
  fraction_ = 0;
}

asio::awaitable<void> History::follow() {
  asio::steady_timer pause(io_);
  while (store_) {
    const auto time = co_await read_page();
    pause.expires_after(scaled(time));
    co_await pause.async_wait(kUse);
  }
}

// Returns the pause until the next page. One page at a time, until the store has it, so that a blocked disk does not
// fill the memory.
asio::awaitable<std::chrono::milliseconds> History::read_page() {
  if (log_.state() != client::State::kConnected) co_return kNotConnected;
  std::function<Result<PeriodStore::Status>(PeriodStore&)> work = [](PeriodStore& store) { return store.open(); };
  std::string after;
  if (status_.is_open) {
    auto page = co_await page_after(status_.cursor);
    has_log_ = page || page.error().code != config::kNoLog;
    if (!page && page.error().code != config::kUnknownCursor) co_return kUpToDate;
    if (page) {
      for (const Period& second : page->seconds) recent_.put(second);
      is_behind_ = page->more;
      fraction_ = page->fraction;
      after = page->after;
      uncommitted_pages_ = is_behind_ ? (uncommitted_pages_ + 1) % kPagesPerCommit : 0;
      work = [page = std::move(*page), commit = uncommitted_pages_ == 0](PeriodStore& store) {
        return store.add(page.from, page.seconds, page.after, commit);
      };
    } else {
      fmt::print(stderr, "prismweb: {} {}: log replaced: filling minutes and hours again\n", log_.name(), axis_);
      work = [](PeriodStore& store) { return store.clear(); };
    }
  }
  co_await on_disk<PeriodStore::Status>(std::move(work), false);
  if (!status_.is_open) co_return kReopen;
  co_return is_behind_ && (after.empty() || status_.cursor == after) ? std::chrono::milliseconds(0) : kUpToDate;
}

asio::awaitable<tl::expected<History::Page, client::RequestError>> History::page_after(std::string cursor) {
  const json params = {{"after", cursor.empty() ? "earliest" : cursor}, {"limit", 10000}, {"axis", axis_}};
  const client::Response response = co_await log_.ask("rows", params);
  if (!response) co_return tl::unexpected(response.error());
  Page page;
  page.from = std::move(cursor);
  try {
    const json& result = client::of_axis(*response, axis_);
    for (const json& segment : result.at("segments")) {
      const std::string names = text_member(member(segment, "metadata"), "sensors");
      const auto sensors = std::make_shared<const std::vector<SensorName>>(compensation::listed_sensors(names));
      const auto& columns = segment.at("columns").get_ref<const std::string&>();
      const auto layout = compensation::CsvLayout::parse(columns, "rows", sensors);
      if (!layout) continue;
      for (const json& line : segment.at("rows")) {
        const auto row = compensation::parse_csv(line.get_ref<const std::string&>(), "rows", *layout);
        if (row) page.seconds.push_back(second_of(*row));
      }
    }
    page.after = result.at("after");
    page.more = result.at("more");
    page.missing = count_member(result, "missing");
    const double kept = number_member(result, "kept"), behind = number_member(result, "behind");
    if (page.more && kept > 0) page.fraction = std::clamp(1 - behind / kept, 0.0, 0.999);
  } catch (const json::exception&) {
    co_return tl::unexpected(
        client::RequestError{config::kFailed, {"prismd", "found an invalid response to \"rows\""}});
  }
  co_return page;
}

asio::awaitable<void> History::load() {
  const auto self = shared_from_this();
  recent_.forget_now();
  const json params = {{"seconds", 3600}, {"axis", axis_}};
  const client::Response history = co_await log_.ask("history", params);
  if (!history) co_return;
  std::vector<Period> since_reset;
  for (const json& window : client::of_axis(*history, axis_)) {
    const auto second = second_of(window);
    if (!second) continue;
    if (!since_reset.empty() && second->begin_s < since_reset.back().begin_s) since_reset.clear();
    since_reset.push_back(*second);
  }
  if (!since_reset.empty()) recent_.put_now(since_reset.back());
  for (const Period& second : since_reset) recent_.put(second);
}

void History::window(const json& params) {
  if (const auto second = second_of(params)) recent_.put_now(*second);
}

std::optional<double> History::building() const {
  if (!store_ || !has_log_ || (!status_.is_open && !status_.problem.empty())) return std::nullopt;
  return is_behind_ ? fraction_ : 1;
}

// Returns nullopt if a param of `range` is invalid.
std::optional<History::View> History::view_of(const json& params) const {
  if (!params.is_null() && !params.is_object()) return std::nullopt;
  bool is_valid = true;
  const auto number = [&](const char* key, double min, double max, double otherwise) {
    const json& value = member(params, key);
    if (value.is_null()) return otherwise;
    is_valid = is_valid && value.is_number() && value >= min && value <= max;
    return is_valid ? value.get<double>() : otherwise;
  };
  const auto has = [&](const char* key) { return !member(params, key).is_null(); };
  const auto stored_s = is_stored() ? status_.last_s : std::nullopt;
  const auto last_s = static_cast<double>((recent_.empty() ? stored_s.value_or(0) : recent_.last_s()) + 1);
  const double to_s =
      number("to_s", -kMaxTime_s, kMaxTime_s, std::max(last_s, number("from_s", -kMaxTime_s, kMaxTime_s, 0)));
  const double from_s = number("from_s", -kMaxTime_s, kMaxTime_s, to_s - number("seconds", 1, kMaxTime_s, 3600));
  const double points = number("points", 2, 5000, 1000);
  if (!is_valid || points != std::floor(points) || (has("from_s") && has("seconds")) || (has("to_s") && from_s >= to_s))
    return std::nullopt;
  const std::int64_t step_s = step_for(std::max(to_s - from_s, 1.0), static_cast<int>(points), 1);
  const auto start_s = floor_to(static_cast<std::int64_t>(std::floor(from_s)), step_s);  // the first step is complete
  return View{start_s,   static_cast<std::int64_t>(std::ceil(to_s)), step_s, static_cast<int>(points), "seconds",
              building()};
}

std::string History::result_of(const View& view, const std::vector<Period>& periods) const {
  auto [columns, rows] = table_of(downsample(periods, view.from_s, view.to_s, view.step_s), view.step_s);
  json first, last;
  if (is_stored() && status_.first_s) {
    first = *status_.first_s + 1;
    last = *status_.last_s + 1;
  }
  if (!recent_.empty()) {
    first = first.is_null() ? recent_.first_s() + 1 : std::min(recent_.first_s() + 1, first.get<std::int64_t>());
    last = recent_.last_s() + 1;
  }
  const json result = {{"axis", axis_},
                       {"from_s", view.from_s},
                       {"to_s", view.to_s},
                       {"step_s", view.step_s},
                       {"source", view.source},
                       {"columns", std::move(columns)},
                       {"rows", std::move(rows)},
                       {"first_s", first},
                       {"last_s", last},
                       {"building", view.building ? json(*view.building) : json()},
                       {"store_problem", status_.problem.empty() ? json() : json(status_.problem)}};
  return "\"result\":" + json_text(result);
}

asio::awaitable<std::string> History::range(json params) {
  const auto self = shared_from_this();
  std::optional<View> wanted = view_of(params);
  if (!wanted)
    co_return error_member(config::kInvalidParams,
                           "range: expected {\"axis\": NAME, \"from_s\": T or \"seconds\": N, \"to_s\": T, "
                           "\"points\": 2 to 5000}");
  View view = *wanted;
  // Times after the last second in memory may be of an earlier run of the gyro's clock.
  const bool is_connected = log_.state() == client::State::kConnected;
  const bool has_all = !is_connected && !recent_.empty() && status_.first_s == recent_.first_s();
  const bool in_memory =
      !recent_.empty() && (view.from_s >= recent_.first_s() || has_all) && view.from_s <= recent_.last_s() + kFresh_s;
  if (!is_stored() || !status_.first_s || in_memory) co_return result_of(view, recent_.after(INT64_MIN));
  if (is_connected && view.to_s - view.from_s <= kMaxLogLength_s) {
    const auto turn = co_await log_turns_.take();
    const Result<std::vector<Period>> seconds = co_await seconds_of_log(view);
    if (!seconds) co_return error_member(config::kFailed, seconds.error().text());
    if (!seconds->empty()) co_return result_of(view, *seconds);
  }
  const auto turn = co_await store_turns_.take();
  view.step_s = step_for(static_cast<double>(view.to_s - view.from_s), view.points, 60);
  view.source = view.step_s >= 3600 ? "hours" : "minutes";
  view.from_s = floor_to(view.from_s, view.step_s);
  std::function<Result<PeriodStore::Periods>(PeriodStore&)> work = [view](PeriodStore& store) {
    return store.periods(view.from_s, view.to_s, view.step_s);
  };
  Result<PeriodStore::Periods> stored = co_await on_disk<PeriodStore::Periods>(std::move(work), true);
  if (!stored) co_return error_member(config::kFailed, stored.error().text());
  // After a reset of the clock, the store may have none of the seconds in memory yet.
  const bool is_reset = !recent_.empty() && stored->last_s > recent_.last_s() + RecentSeconds::kClockReset_s;
  for (const Period& second : recent_.after(is_reset ? INT64_MIN : stored->last_s.value_or(INT64_MIN)))
    stored->steps.push_back(second);
  co_return result_of(view, stored->steps);
}

// Reads the log page by page, from a cursor before the view to the first second in memory. If the gyro's clock was
// reset, a time may occur in several of its runs: returns the seconds of the last run that has some. Returns nothing if
// retention deleted the seconds, or if the store does not know where they are.
asio::awaitable<Result<std::vector<Period>>> History::seconds_of_log(View view) {
  std::function<Result<PeriodStore::Cursors>(PeriodStore&)> work = [view](PeriodStore& store) {
    return store.cursors_before(view.from_s);
  };
  Result<PeriodStore::Cursors> cursors = co_await on_disk<PeriodStore::Cursors>(std::move(work), true);
  if (!cursors) co_return tl::unexpected<Error>(cursors.error());
  if (cursors->empty() && status_.first_s) cursors->emplace_back(*status_.first_s, "");
  if (cursors->size() > kMaxRuns) cursors->resize(kMaxRuns);
  std::int64_t memory_s = INT64_MAX;
  if (!recent_.empty() && view.from_s < recent_.first_s()) memory_s = recent_.first_s();
  const std::int64_t end_s = std::min(view.to_s, memory_s);
  std::vector<Period> found;
  for (std::size_t i = 0; i < cursors->size() && found.empty(); ++i) {
    auto [begin_s, cursor] = (*cursors)[i];
    if (is_behind_ && begin_s + kFar_s < view.from_s) continue;  // that may be days of rows
    bool is_past = false;
    for (int count = 0; count < kMaxPages && !is_past; ++count) {
      const auto page = co_await page_after(cursor);
      if (!page) co_return tl::unexpected<Error>(page.error().error);
      const bool begins_later = page->seconds.empty() || page->seconds.front().begin_s > view.from_s;
      if (page->missing > 0 && found.empty() && begins_later) co_return found;
      for (const Period& second : page->seconds) {
        if (second.begin_s >= view.from_s && second.begin_s < end_s) found.push_back(second);
      }
      is_past = !page->more || (!page->seconds.empty() && page->seconds.back().begin_s >= end_s);
      cursor = page->after;
    }
  }
  const std::vector<Period> newer = recent_.after(memory_s - 1);
  found.insert(found.end(), newer.begin(), newer.end());
  co_return found;
}

}  // namespace prism::prismweb
