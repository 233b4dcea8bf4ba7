// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/mount.h>

#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismweb/history.hpp"

namespace prism::prismweb {
namespace {

namespace fs = std::filesystem;
constexpr std::int64_t kBegin = 1795425000 / 3600 * 3600;

Period at(std::int64_t i) {
  compensation::CompensatedWindow row;
  row.window.second_mean.second = kBegin + i;
  const double rate = std::sin(static_cast<double>(i) * 0.37) * static_cast<double>(i % 97);
  if (i % 5 != 0) row.window.second_mean.rate_deg_per_h = rate;
  row.window.second_mean.samples = 1000;
  return second_of(row);
}

std::vector<Period> seconds_of(std::int64_t from, std::int64_t to) {
  std::vector<Period> seconds;
  for (std::int64_t i = from; i < to; ++i) seconds.push_back(at(i));
  return seconds;
}

std::string shown(const std::vector<Period>& periods) {
  std::string text;
  for (const Period& one : periods) {
    text += std::to_string(one.begin_s - kBegin) + ":";
    for (const Column column : {kRateMin, kRateMax, kSeconds, kSamples, kRateKnown, kRateSum})
      text += std::to_string(one.values[column]) + ",";
    text += " ";
  }
  return text;
}

// The minutes of a store that was never closed.
std::string expected_minutes(std::int64_t to) { return shown(downsample(seconds_of(0, to), INT64_MIN, INT64_MAX, 60)); }

class PeriodStoreTest : public testing::Test {
 protected:
  std::unique_ptr<PeriodStore> opened(const std::string& folder = "z") {
    auto store = std::make_unique<PeriodStore>(folder_.file(folder));
    EXPECT_TRUE(store->open().is_open) << store->status().problem;
    return store;
  }
  // The cursor is the number of seconds.
  static PeriodStore::Status add(PeriodStore& store, std::int64_t from, std::int64_t to, bool commit = true) {
    return store.add(from == 0 ? "" : std::to_string(from), seconds_of(from, to), std::to_string(to), commit);
  }
  static std::string minutes(PeriodStore& store) {
    const auto found = store.periods(INT64_MIN, INT64_MAX, 60);
    return found ? shown(found->steps) : found.error().text();
  }
  void change(const std::string& sql) {
    sqlite3* file = nullptr;
    ASSERT_EQ(sqlite3_open(folder_.file("z/periods.sqlite").c_str(), &file), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(file, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(file);
    sqlite3_close(file);
  }
  test::TemporaryFolder folder_;
};

TEST_F(PeriodStoreTest, ContinuesAfterReopening) {
  for (std::int64_t i = 0; i < 1000; i += 37) {
    const auto store = opened();
    EXPECT_EQ(store->status().cursor, i == 0 ? "" : std::to_string(i));
    EXPECT_EQ(store->status().problem, "");
    EXPECT_EQ(add(*store, i, i + 37).problem, "");
  }
  const auto store = opened();
  EXPECT_EQ(minutes(*store), expected_minutes(1036));
  EXPECT_EQ(store->periods(INT64_MIN, INT64_MAX, 3600)->steps.size(), 1U);
  EXPECT_EQ(store->status().first_s, kBegin);
  EXPECT_EQ(store->status().last_s, kBegin + 1035);
}

// Also across two transactions that have seconds of the same minute, and with a sensor that was added later.
TEST_F(PeriodStoreTest, KeepsMinimumAndMaximumOfOtherSensors) {
  auto store = opened();
  for (std::int64_t i = 0; i < 4; ++i) {
    Period second = at(i);
    if (i > 0) second.sensors["case"] = {20.0 + static_cast<double>(i), 20.0 + static_cast<double>(i)};
    if (i == 3) second.sensors["chamber.pressure"] = {1e5, 1e5};
    store->add(store->status().cursor, std::vector{second}, std::to_string(i + 1), true);
  }
  store = nullptr;
  const auto found = opened()->periods(INT64_MIN, INT64_MAX, 3600);
  ASSERT_EQ(found->steps.size(), 1U);
  const std::map<std::string, std::array<double, 2>> expected = {{"case", {21, 23}}, {"chamber.pressure", {1e5, 1e5}}};
  EXPECT_EQ(found->steps[0].sensors, expected);
  EXPECT_EQ(found->steps[0].values[kSeconds], 4);
  change("UPDATE hours SET sensors = '{\"case\": 1}'");
  store = opened();
  EXPECT_FALSE(store->periods(INT64_MIN, INT64_MAX, 3600));
  EXPECT_EQ(store->status().cursor, "") << "it is filled again";
}

// Uncommitted seconds and their cursor are lost together, so the same rows are read again.
TEST_F(PeriodStoreTest, UncommittedDataIsReadFromTheLogAgain) {
  auto store = opened();
  add(*store, 0, 500);
  add(*store, 500, 900, false);
  EXPECT_EQ(minutes(*store), expected_minutes(900));
  store = nullptr;
  store = opened();
  EXPECT_EQ(store->status().cursor, "500");
  add(*store, 500, 600, false);
  add(*store, 600, 1000);
  store = nullptr;
  EXPECT_EQ(minutes(*opened()), expected_minutes(1000));
}

// A page requested before the store was emptied would leave a gap.
TEST_F(PeriodStoreTest, IgnoresAPageAfterAnotherCursor) {
  const auto store = opened();
  add(*store, 0, 60);
  EXPECT_EQ(store->clear().cursor, "");
  EXPECT_EQ(add(*store, 60, 120).cursor, "");
  EXPECT_EQ(store->status().first_s, std::nullopt);
}

// Files after a kill at any time: the database without its last transactions, and a truncated write-ahead log.
TEST_F(PeriodStoreTest, AKillLosesNoRows) {
  const auto store = opened();
  for (std::int64_t i = 0; i < 6000; i += 100) add(*store, i, i + 100);
  const auto bytes = fs::file_size(folder_.file("z/periods.sqlite-wal"));
  for (std::uintmax_t size = 0; size <= bytes; size += std::min<std::uintmax_t>(4567, bytes - size + (size == bytes))) {
    fs::remove_all(folder_.file("killed"));
    fs::copy(folder_.file("z"), folder_.file("killed"));
    fs::resize_file(folder_.file("killed/periods.sqlite-wal"), size);
    const auto again = opened("killed");
    EXPECT_EQ(again->status().problem, "") << size;
    const std::string cursor = again->status().cursor;
    add(*again, cursor.empty() ? 0 : std::stoll(cursor), 6000);
    EXPECT_EQ(minutes(*again), expected_minutes(6000)) << size << " from " << cursor;
  }
}

// Whatever SQLite's check or the sums notice is deleted; then the store accepts new seconds.
TEST_F(PeriodStoreTest, ADamagedStoreIsEmptiedAndNamesTheDamage) {
  for (const auto& [sql, problem] :
       {std::pair("DELETE FROM minutes WHERE begin_s % 600 = 0", "found 7160 seconds in minutes, expected 8000"),
        {"DELETE FROM hours WHERE begin_s % 7200 = 0", "seconds in hours, expected 8000"},
        {"DELETE FROM state", "found 8000 seconds in minutes, expected "},
        {"DROP TABLE minutes", "no such table: minutes"},
        {"DROP TABLE cursors", "no such table: cursors"},
        {"ALTER TABLE minutes DROP COLUMN uhfo_max", "table minutes has 22 columns but 23 values were supplied"},
        {"PRAGMA user_version = 3", "found version 3"}}) {
    {
      const auto store = opened();
      store->clear();
      add(*store, 0, 8000);
    }
    change(sql);
    const auto store = opened();
    if (store->status().problem.empty()) add(*store, 8000, 8001);  // noticed only when the table is used
    EXPECT_NE(store->status().problem.find(problem), std::string::npos) << sql << ": " << store->status().problem;
    EXPECT_NE(store->status().problem.find("periods.sqlite: "), std::string::npos) << store->status().problem;
    EXPECT_TRUE(store->status().problem.ends_with("; filling it again from the log")) << store->status().problem;
    EXPECT_EQ(store->status().cursor, "") << sql;
    EXPECT_EQ(add(*store, 0, 100).problem, "");
    EXPECT_EQ(minutes(*store), expected_minutes(100)) << sql;
  }
}

// Flips one bit in every 211th byte of the closed file. The store has all seconds, or it is emptied.
TEST_F(PeriodStoreTest, AChangedBitLosesNoRows) {
  {
    const auto store = opened();
    add(*store, 0, 8000);
  }
  std::ifstream file(folder_.file("z/periods.sqlite"), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  fs::create_directory(folder_.file("damaged"));
  std::size_t noticed = 0;
  for (std::size_t i = 0; i < bytes.size(); i += 211) {
    std::string changed = bytes;
    changed[i] = static_cast<char>(changed[i] ^ (1 << (i % 8)));
    std::ofstream(folder_.file("damaged/periods.sqlite"), std::ios::binary) << changed;
    const auto store = opened("damaged");
    const auto found = store->periods(INT64_MIN, INT64_MAX, 60);
    double seconds = 0;
    for (const Period& one : found ? found->steps : std::vector<Period>()) seconds += one.values[kSeconds];
    if (store->status().problem.empty()) {
      EXPECT_EQ(seconds, 8000) << i;
      continue;
    }
    ++noticed;
    EXPECT_EQ(store->status().cursor, "") << i;
    EXPECT_EQ(add(*store, 0, 100).problem, "") << i;
    ASSERT_EQ(minutes(*store), expected_minutes(100)) << i;
  }
  EXPECT_GT(noticed, 5U);
}

TEST_F(PeriodStoreTest, ReplacesAFileThatIsNotADatabase) {
  for (const char* const text : {"{\"version\":1}", "SQLite format 3"}) {
    fs::create_directories(folder_.file("z"));
    std::ofstream(folder_.file("z/periods.sqlite")) << text << std::string(9000, 'x');
    EXPECT_NE(opened()->status().problem, "");
    EXPECT_EQ(opened()->status().problem, "");
  }
}

// A database is damaged while it is open: the next use empties it.
TEST_F(PeriodStoreTest, ReportsDamageWhenReadAndStartsAgain) {
  const auto store = opened();
  for (std::int64_t i = 0; i < 300000; i += 10000) add(*store, i, i + 10000);
  std::fstream file(folder_.file("z/periods.sqlite"), std::ios::in | std::ios::out | std::ios::binary);
  const auto size = fs::file_size(folder_.file("z/periods.sqlite"));
  for (std::uintmax_t page = 1; page < size / 4096; ++page) {
    file.seekp(static_cast<std::streamoff>(page * 4096));
    file.put('\x55');  // no page of a table
  }
  file.close();
  const auto found = store->periods(INT64_MIN, INT64_MAX, 60);
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().text().find("malformed"), std::string::npos) << found.error().text();
  EXPECT_EQ(store->status().cursor, "");
  EXPECT_EQ(add(*store, 0, 100).problem, "");
  EXPECT_EQ(minutes(*store), expected_minutes(100));
}

TEST_F(PeriodStoreTest, IsLockedByOneProcess) {
  const auto store = opened();
  PeriodStore second(folder_.file("z"));
  EXPECT_FALSE(second.open().is_open);
  EXPECT_NE(second.status().problem.find("periods.sqlite: is in use by another process"), std::string::npos)
      << second.status().problem;
}

TEST_F(PeriodStoreTest, ADayIsSmallAndReadInParts) {
  const auto store = opened();
  for (std::int64_t i = 0; i < 86400; i += 1200) add(*store, i, i + 1200);
  EXPECT_LE(fs::file_size(folder_.file("z/periods.sqlite")), 300U << 10);
  EXPECT_LE(fs::file_size(folder_.file("z/periods.sqlite-wal")), 1U << 20) << "it does not grow over time";
  const auto part = store->periods(kBegin + 39600, kBegin + 49800, 60);
  ASSERT_TRUE(part);
  EXPECT_EQ(part->steps.front().begin_s, kBegin + 39600);
  EXPECT_EQ(part->steps.size(), 170U);
  EXPECT_EQ(store->periods(INT64_MIN, INT64_MAX, 3600)->steps.size(), 24U);
  EXPECT_EQ(store->periods(INT64_MIN, INT64_MAX, 600)->steps.size(), 144U);
  EXPECT_EQ(store->periods(INT64_MIN, INT64_MAX, 86400)->steps.size(), 2U) << "midnight is within the data";
  EXPECT_EQ(*store->cursors_before(kBegin + 1199), PeriodStore::Cursors());
  EXPECT_EQ(*store->cursors_before(kBegin + 1200), (PeriodStore::Cursors{{kBegin + 1200, "1200"}}));
  EXPECT_EQ(*store->cursors_before(kBegin + 80000), (PeriodStore::Cursors{{kBegin + 76800, "76800"}}));
}

// A counter restarted: a time that occurs only in the earlier run was searched in the later one and not found.
TEST_F(PeriodStoreTest, ReturnsACursorPerRunOfTheClock) {
  const auto store = opened();
  const auto keep = [&](std::int64_t from, std::int64_t to, const std::string& cursor) {
    EXPECT_EQ(store->add(store->status().cursor, seconds_of(from, to), cursor, true).problem, "");
  };
  keep(0, 1000, "first-1000");
  keep(1000, 12000, "first-12000");
  keep(5000, 6000, "second-6000");
  const auto cursors = [&](std::int64_t second) {
    std::string names;
    const auto found = store->cursors_before(kBegin + second);
    for (const auto& [begin_s, cursor] : *found) names += cursor + " ";
    return names;
  };
  EXPECT_EQ(cursors(7000), "second-6000 first-1000 ");
  EXPECT_EQ(cursors(12500), "second-6000 first-12000 ");
  EXPECT_EQ(cursors(2000), "first-1000 ");
  double seconds = 0;
  const auto all = store->periods(INT64_MIN, INT64_MAX, 60);
  for (const Period& one : all->steps) seconds += one.values[kSeconds];
  EXPECT_EQ(seconds, 13000) << "a clock that is set back loses no rows";
  EXPECT_EQ(store->status().last_s, kBegin + 5999);
}

// While it exists, each write of SQLite to a file fails with `reason`.
class FailingWrites {
 public:
  explicit FailingWrites(int reason) {
    reason_ = reason;
    set(&fail);
  }
  ~FailingWrites() { set(nullptr); }

 private:
  static ssize_t fail(int, const void*, std::size_t, off_t) {
    errno = reason_;
    return -1;
  }
  static void set(ssize_t (*call)(int, const void*, std::size_t, off_t)) {
    sqlite3_vfs* const vfs = sqlite3_vfs_find(nullptr);
    for (const char* const name : {"pwrite", "pwrite64"})
      vfs->xSetSystemCall(vfs, name, reinterpret_cast<sqlite3_syscall_ptr>(call));
  }
  static inline int reason_ = 0;
};

// A disk failed for 8 s: each retry appended the same minutes, and a minute then had 300 seconds.
TEST_F(PeriodStoreTest, AFailedCommitIsRolledBackAndReadAgain) {
  auto store = opened();
  add(*store, 0, 1000);
  add(*store, 1000, 3700, false);
  struct Failure {
    int reason;
    std::string text, or_text;
  };
  // SQLite 3.40 keeps no errno of a failed write, 3.46 does
  for (const auto& [reason, text, or_text] :
       {Failure{ENOSPC, "No space left on device", ""}, {EIO, "Input/output error", "disk I/O error"}}) {
    const FailingWrites disk(reason);
    const auto status = add(*store, store->status().cursor == "1000" ? 1000 : 3700, 3800);
    const std::string found = status.problem.substr(status.problem.find("periods.sqlite: ") + 16);
    EXPECT_TRUE(found == text || found == or_text) << status.problem;
    EXPECT_EQ(status.cursor, "1000");
    EXPECT_EQ(minutes(*store), expected_minutes(1000));
  }
  EXPECT_NE(add(*store, 1000, 2000, false).problem, "") << "not on disk yet";
  EXPECT_EQ(add(*store, 2000, 4000).problem, "");
  store = nullptr;
  EXPECT_EQ(minutes(*opened()), expected_minutes(4000));
}

// A disk without a free inode was reported as "No such file or directory".
TEST_F(PeriodStoreTest, AFileThatCannotBeCreatedHasTheDisksReason) {
  const std::string full = folder_.file("full");
  for (const bool with_database : {false, true}) {  // no inode for the database, or none for its log
    fs::create_directory(full);
    if (::mount("tmpfs", full.c_str(), "tmpfs", 0, "size=1m,nr_inodes=2") != 0) GTEST_SKIP() << "needs root, to mount";
    if (!with_database) std::ofstream(full + "/other") << "text";
    PeriodStore store(full);
    const std::string problem = store.open().problem;
    ::umount(full.c_str());
    EXPECT_EQ(problem, full + "/periods.sqlite: No space left on device") << with_database;
  }
  std::ofstream(folder_.file("file")) << "a file instead of the directory";
  PeriodStore store(folder_.file("file/z"));
  EXPECT_NE(store.open().problem.find("file/z/periods.sqlite: Not a directory"), std::string::npos)
      << store.status().problem;
}

}  // namespace
}  // namespace prism::prismweb
