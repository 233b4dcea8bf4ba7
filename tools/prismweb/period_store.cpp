// SPDX-License-Identifier: MIT
#include "tools/prismweb/period_store.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <system_error>

namespace prism::prismweb {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kCursorInterval_s = 3 * 3600;

std::string table_of(const char* name) {
  std::string columns;
  for (std::size_t i = 0; i < kPeriodColumns.size(); ++i)
    columns += fmt::format("{} {}, ", kPeriodColumns[i], i >= kFirstCount ? "INTEGER" : "REAL");
  return fmt::format("{} (begin_s INTEGER PRIMARY KEY, {}crc INTEGER)", name, columns);
}

Result<void> remove_all(const std::string& folder, std::initializer_list<const char*> names) {
  for (const char* const name : names) {
    std::error_code error;
    fs::remove(fs::path(folder) / name, error);
    if (error) return make_error((fs::path(folder) / name).string(), error.message());
  }
  return {};
}

}  // namespace

Result<void> PeriodStore::remove(const std::string& folder) {
  return remove_all(folder, {"periods.sqlite-wal", "periods.sqlite"});
}

// Removes the files of prismweb 0.2; the database is built from the log.
Result<PeriodStore> PeriodStore::open(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return make_error(folder, error.message());
  if (const auto removed = remove_all(folder, {"place.json", "minutes", "hours"}); !removed)
    return tl::unexpected<Error>(removed.error());
  std::optional<PeriodStore> store(std::in_place);
  Result<void> loaded = store->load(folder);
  if (!loaded && store->is_damaged()) {
    const std::string why = loaded.error().text() + kRebuilt;
    store.emplace();
    loaded = remove(folder);
    if (loaded) loaded = store->load(folder);
    store->rebuild_reason_ = why;
  }
  if (!loaded) return tl::unexpected<Error>(loaded.error());
  return std::move(*store);
}

Result<void> PeriodStore::load(const std::string& folder) {
  std::error_code error;
  const fs::path real = fs::canonical(folder, error);  // SQLITE_OPEN_NOFOLLOW rejects links in any part
  if (error) return make_error(folder, error.message());
  Result<void> done = database_.open((real / "periods.sqlite").string());
  std::vector<std::string> tables = {
      "state (id INTEGER PRIMARY KEY, cursor TEXT, first_s INTEGER, last_s INTEGER, crc INTEGER)",
      "places (id INTEGER PRIMARY KEY, begin_s INTEGER, cursor TEXT, crc INTEGER)"};
  for (const Table& table : tables_) tables.push_back(table_of(table.name));
  for (const std::string& table : tables) {
    if (done) done = database_.run("CREATE TABLE IF NOT EXISTS " + table);
  }
  const auto take_state = [&](const Database::Row& row) {
    cursor_ = row.text(0);
    first_second_ = row.integer(1);
    last_second_ = row.integer(2);
  };
  const auto take_cursor = [&](const Database::Row& row) { cursors_.emplace_back(row.integer(0), row.text(1)); };
  if (done)
    done = database_.run("SELECT checked(crc, cursor, first_s, last_s), first_s, last_s FROM state", {}, take_state);
  if (done)
    done = database_.run("SELECT checked(crc, begin_s, cursor), cursor FROM places ORDER BY id", {}, take_cursor);
  return done;
}

void PeriodStore::push(std::span<const PeriodSummary> seconds, const std::string& cursor) {
  for (const PeriodSummary& second : seconds) {
    for (Table& table : tables_) {
      const std::int64_t begin_s = floor_to(second.begin_s, table.length_s);
      PeriodSummary& period = table.pushed.try_emplace(begin_s, PeriodSummary{}).first->second;
      period.begin_s = begin_s;
      period.add(second);
    }
    if (!first_second_) first_second_ = second.begin_s;
    last_second_ = second.begin_s;
  }
  cursor_ = cursor;
  is_committed_ = false;
}

// Atomic: after an error the pushed periods remain for the next commit().
Result<void> PeriodStore::commit() {
  // The next row follows the last second. A cursor every 3 h finds old seconds in the log.
  const std::int64_t next_s = last_second_.value_or(INT64_MIN) + 1;
  const bool with_cursor = last_second_ && (cursors_.empty() || next_s < cursors_.back().first ||
                                            next_s - cursors_.back().first >= kCursorInterval_s);
  Result<void> done = database_.run("BEGIN");
  if (done) done = write_all(with_cursor);
  if (done) done = database_.run("COMMIT");
  if (!done) {
    database_.roll_back();
    return done;
  }
  for (Table& table : tables_) table.pushed.clear();
  if (with_cursor) cursors_.emplace_back(next_s, cursor_);
  is_committed_ = true;
  return done;
}

Result<void> PeriodStore::write_all(bool with_cursor) {
  Result<void> done;
  for (const Table& table : tables_) {
    if (done) done = write(table);
  }
  if (!last_second_) return done;
  if (done)
    done = database_.run("REPLACE INTO state VALUES (1, ?1, ?2, ?3, crc(?1, ?2, ?3))",
                         {cursor_, *first_second_, *last_second_});
  if (done && with_cursor)
    done = database_.run("INSERT INTO places VALUES (NULL, ?1, ?2, crc(?1, ?2))", {*last_second_ + 1, cursor_});
  return done;
}

Result<void> PeriodStore::write(const Table& table) {
  std::vector<std::string> placeholders;
  for (std::size_t i = 0; i <= kPeriodColumns.size(); ++i) placeholders.push_back(fmt::format("?{}", i + 1));
  const std::string sql =
      fmt::format("REPLACE INTO {0} VALUES ({1}, crc({1}))", table.name, fmt::join(placeholders, ", "));
  for (const auto& [begin_s, pushed] : table.pushed) {
    const auto stored = read(table, begin_s, begin_s + 1);
    if (!stored) return tl::unexpected<Error>(stored.error());
    PeriodSummary period = pushed;
    for (const PeriodSummary& part : *stored) period.add(part);
    std::vector<Database::Value> values = {begin_s};
    for (const double value : values_of(period)) values.emplace_back(value);
    if (Result<void> done = database_.run(sql, values); !done) return done;
  }
  return {};
}

Result<std::vector<PeriodSummary>> PeriodStore::read(const Table& table, std::int64_t from_s, std::int64_t to_s) {
  std::vector<PeriodSummary> found;
  const auto take = [&](const Database::Row& row) {
    if (row.integer(0) < from_s || row.integer(0) >= to_s) return;
    PeriodValues values;
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = row.number(static_cast<int>(i) + 1);
    found.push_back(period_of(row.integer(0), values));
  };
  // Includes one record before and one after: a damaged begin is still between its neighbours, but maybe not in the
  // range.
  const std::string sql = fmt::format(
      "SELECT checked(crc, begin_s, {0}), {0} FROM {1}"
      " WHERE begin_s >= coalesce((SELECT max(begin_s) FROM {1} WHERE begin_s < ?1), ?1)"
      " AND begin_s <= coalesce((SELECT min(begin_s) FROM {1} WHERE begin_s >= ?2), ?2) ORDER BY begin_s",
      fmt::join(kPeriodColumns, ", "), table.name);
  const Result<void> done = database_.run(sql, {from_s, to_s}, take);
  if (!done) return tl::unexpected<Error>(done.error());
  return found;
}

std::vector<std::string> PeriodStore::cursors_before(std::int64_t second) const {
  std::vector<std::string> found;
  std::int64_t later_s = INT64_MAX;  // of the next stored cursor
  bool has_cursor = false;           // of this clock epoch
  for (auto stored = cursors_.rbegin(); stored != cursors_.rend(); ++stored) {
    if (stored->first >= later_s) has_cursor = false;
    later_s = stored->first;
    if (!has_cursor && stored->first <= second) {
      found.push_back(stored->second);
      has_cursor = true;
    }
  }
  return found;
}

Result<std::vector<PeriodSummary>> PeriodStore::periods(std::int64_t step_s, std::int64_t from_s, std::int64_t to_s) {
  const auto divides = [&](const Table& table) { return step_s % table.length_s == 0; };
  const Table& table = *std::find_if(tables_.rbegin(), tables_.rend() - 1, divides);
  auto found = read(table, from_s, to_s);
  if (!found) return found;
  for (auto at = table.pushed.lower_bound(from_s); at != table.pushed.end() && at->first < to_s; ++at)
    found->push_back(at->second);
  return found;
}

}  // namespace prism::prismweb
