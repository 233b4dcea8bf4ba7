// SPDX-License-Identifier: MIT
#include "tools/prismweb/period_store.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/mount.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismweb/archive.hpp"

namespace prism::prismweb {
namespace {

namespace fs = std::filesystem;
constexpr std::int64_t kBegin = 1795425000 / 3600 * 3600;

PeriodSummary at(std::int64_t i) {
  PeriodSummary one;
  one.begin_s = kBegin + i;
  one.min[kRate] = one.max[kRate] = std::sin(static_cast<double>(i) * 0.37) * static_cast<double>(i % 97);
  if (i % 5 != 0) one.mean[kRate].take(one.min[kRate]);
  one.samples = 1000;
  one.seconds = one.good = 1;
  return one;
}

PeriodStore opened(const test::TemporaryFolder& folder) {
  auto store = PeriodStore::open(folder.file("z"));
  EXPECT_TRUE(store) << store.error().text();
  return std::move(*store);
}

void push(PeriodStore& store, std::int64_t from, std::int64_t to, const std::string& cursor) {
  std::vector<PeriodSummary> seconds;
  for (std::int64_t i = from; i < to; ++i) seconds.push_back(at(i));
  store.push(seconds, cursor);
}

std::string shown(const std::vector<PeriodSummary>& periods) {
  std::string text;
  for (const PeriodSummary& one : periods)
    text += std::to_string(one.begin_s - kBegin) + ":" + std::to_string(one.min[kRate]) + "/" +
            std::to_string(one.max[kRate]) + "*" + std::to_string(one.seconds) + "," + std::to_string(one.samples) +
            "m" + std::to_string(one.mean[kRate].known) + "~" +
            std::to_string(std::lround(1000 * one.mean[kRate].value())) + " ";
  return text;
}
std::vector<PeriodSummary> joined(const Result<std::vector<PeriodSummary>>& periods, std::int64_t length_s) {
  EXPECT_TRUE(periods) << periods.error().text();
  return downsample(*periods, INT64_MIN, INT64_MAX, length_s);
}
std::string minutes(PeriodStore& store) { return shown(joined(store.periods(60, INT64_MIN, INT64_MAX), 60)); }
std::string minutes(PeriodStore&& store) { return minutes(store); }

// The minutes of a store that was never closed.
std::string expected_minutes(std::int64_t to) {
  std::vector<PeriodSummary> seconds;
  for (std::int64_t i = 0; i < to; ++i) seconds.push_back(at(i));
  return shown(downsample(seconds, INT64_MIN, INT64_MAX, 60));
}

struct PeriodStoreTest : testing::Test {
  const test::TemporaryFolder folder;
};

TEST_F(PeriodStoreTest, ContinuesAfterReopening) {
  std::string cursor;
  for (std::int64_t i = 0; i < 1000; i += 37) {
    PeriodStore store = opened(folder);
    EXPECT_EQ(store.cursor(), cursor);
    cursor = "after-" + std::to_string(i + 37);
    push(store, i, i + 37, cursor);
    ASSERT_TRUE(store.commit());
  }
  PeriodStore store = opened(folder);
  EXPECT_EQ(minutes(store), expected_minutes(1036));
  EXPECT_EQ(shown(joined(store.periods(3600, INT64_MIN, INT64_MAX), 3600)).substr(0, 2), "0:");
  EXPECT_EQ(store.first_second(), kBegin);
  EXPECT_EQ(store.last_second(), kBegin + 1035);
}

// Uncommitted seconds and their cursor are lost together, so the same rows are read again.
TEST_F(PeriodStoreTest, UncommittedDataIsReadFromTheLogAgain) {
  {
    PeriodStore store = opened(folder);
    push(store, 0, 500, "after-500");
    ASSERT_TRUE(store.commit());
    push(store, 500, 900, "after-900");
    EXPECT_EQ(minutes(store), expected_minutes(900)) << "periods() includes pushed seconds";
  }
  PeriodStore store = opened(folder);
  EXPECT_EQ(store.cursor(), "after-500");
  EXPECT_EQ(store.rebuild_reason(), "");
  push(store, 500, 1000, "after-1000");
  ASSERT_TRUE(store.commit());
  EXPECT_EQ(minutes(store), expected_minutes(1000));
  store = opened(test::TemporaryFolder());  // closes the first one
  EXPECT_EQ(minutes(opened(folder)), expected_minutes(1000));
}

// Files after a kill at any time: the database without its last transactions, and a truncated write-ahead log.
TEST_F(PeriodStoreTest, AKillLosesNoRows) {
  const test::TemporaryFolder killed;
  PeriodStore store = opened(folder);
  for (std::int64_t i = 0; i < 6000; i += 100) {
    push(store, i, i + 100, std::to_string(i + 100));
    ASSERT_TRUE(store.commit());
  }
  const std::string log = folder.file("z/periods.sqlite-wal"), copied = killed.file("z/periods.sqlite-wal");
  const auto bytes = fs::file_size(log);
  for (std::uintmax_t size = 0; size <= bytes; size += std::min<std::uintmax_t>(4567, bytes - size + (size == bytes))) {
    fs::remove_all(killed.file("z"));
    fs::copy(folder.file("z"), killed.file("z"));
    fs::resize_file(copied, size);
    PeriodStore again = opened(killed);
    EXPECT_EQ(again.rebuild_reason(), "") << size;
    const std::int64_t done = again.cursor().empty() ? 0 : std::stoll(again.cursor());
    EXPECT_TRUE(size < bytes || done == 6000) << done;
    push(again, done, 6000, "6000");
    ASSERT_TRUE(again.commit());
    EXPECT_EQ(minutes(again), expected_minutes(6000)) << size << " from " << done;
  }
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Flips one bit in every 211th byte of the closed file. The store returns the same periods or is rebuilt, and then
// accepts new seconds.
TEST_F(PeriodStoreTest, DetectsAChangedBit) {
  const test::TemporaryFolder damaged;
  {
    PeriodStore store = opened(folder);
    push(store, 0, 8000, "after");
    ASSERT_TRUE(store.commit());
  }
  const std::string bytes = bytes_of(folder.file("z/periods.sqlite"));
  fs::create_directory(damaged.file("z"));
  std::size_t noticed = 0;
  for (std::size_t i = 0; i < bytes.size(); i += 211) {
    std::string changed = bytes;
    changed[i] = static_cast<char>(changed[i] ^ (1 << (i % 8)));
    std::ofstream(damaged.file("z/periods.sqlite"), std::ios::binary) << changed;
    PeriodStore store = opened(damaged);
    const auto found = store.periods(60, INT64_MIN, INT64_MAX), hours = store.periods(3600, INT64_MIN, INT64_MAX);
    if (!found || !hours) {
      EXPECT_TRUE(store.is_damaged()) << i;
      ++noticed;
      store = opened(test::TemporaryFolder());
      ASSERT_TRUE(PeriodStore::remove(damaged.file("z")));
      store = opened(damaged);
    } else if (!store.rebuild_reason().empty()) {
      EXPECT_NE(store.rebuild_reason().find("periods.sqlite: "), std::string::npos) << store.rebuild_reason();
      EXPECT_EQ(store.cursor(), "") << i;
      ++noticed;
    } else {
      EXPECT_EQ(shown(joined(found, 60)), expected_minutes(8000)) << i;
      EXPECT_EQ(hours->size(), 3U) << i;
      EXPECT_EQ(store.cursor(), "after") << i;
      EXPECT_EQ(store.first_second(), kBegin) << i;
      EXPECT_EQ(store.last_second(), kBegin + 7999) << i;
      continue;
    }
    push(store, 0, 100, "after-100");
    ASSERT_TRUE(store.commit()) << i;
    ASSERT_EQ(minutes(store), expected_minutes(100)) << i;
  }
  EXPECT_GT(noticed, bytes.size() / 211 / 5) << "a third of the bytes are records";
}

// A record whose begin is changed, but still between its neighbours, was missing in a view that contains its true begin
// only.
TEST_F(PeriodStoreTest, DetectsAChangedBeginOutsideTheRange) {
  {
    PeriodStore store = opened(folder);
    push(store, 0, 300, "after-300");
    push(store, 7200, 7500, "after-7500");
    ASSERT_TRUE(store.commit());
  }
  sqlite3* file = nullptr;
  ASSERT_EQ(sqlite3_open(folder.file("z/periods.sqlite").c_str(), &file), SQLITE_OK);
  const std::string changes =
      "UPDATE minutes SET begin_s = begin_s + 512 WHERE begin_s = " + std::to_string(kBegin + 240) +
      "; UPDATE hours SET begin_s = begin_s - 512 WHERE begin_s = " + std::to_string(kBegin + 7200);
  ASSERT_EQ(sqlite3_exec(file, changes.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(file);
  PeriodStore store = opened(folder);
  EXPECT_EQ(store.periods(60, kBegin, kBegin + 180)->size(), 3U) << "its neighbours are good";
  EXPECT_FALSE(store.periods(60, kBegin, kBegin + 300));
  EXPECT_TRUE(store.is_damaged());
  EXPECT_FALSE(store.periods(3600, kBegin + 7200, kBegin + 10800));
}

void flip(const std::string& path, std::size_t at, int bit) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(static_cast<std::streamoff>(at));
  const int byte = file.get();
  file.seekp(static_cast<std::streamoff>(at));
  file.put(static_cast<char>(byte ^ (1 << bit)));
}

// Flips bits of the file and of its write-ahead log while the store is open and larger than its cache. Each view of an
// hour is true or an error. Without a check of pages, a record that vanished from its page was missing in the chart.
TEST_F(PeriodStoreTest, DetectsAChangedBitWhileOpen) {
  constexpr std::int64_t kLength_s = 300000, kHour_s = 3600;
  PeriodStore store = opened(folder);
  for (std::int64_t i = 0; i < kLength_s; i += 10000) {
    push(store, i, i + 10000, std::to_string(i + 10000));
    ASSERT_TRUE(store.commit());
  }
  std::vector<std::string> expected;
  const auto hour_of = [&](std::int64_t from_s) {
    return store.periods(60, kBegin + from_s, kBegin + from_s + kHour_s);
  };
  for (std::int64_t from_s = 0; from_s < kLength_s; from_s += kHour_s)
    expected.push_back(shown(joined(hour_of(from_s), 60)));
  EXPECT_EQ(minutes(store), expected_minutes(kLength_s));
  struct Target {
    const char* name;
    std::size_t first, step;  // offsets of the pages
    int min_noticed;
  };
  for (const auto& [name, first, step, min_noticed] :
       {Target{"z/periods.sqlite", 0, 4096, 15}, Target{"z/periods.sqlite-wal", 56, 4120, 1}}) {
    const auto size = static_cast<std::size_t>(fs::file_size(folder.file(name)));
    int noticed = 0;
    for (std::size_t part = 0; part < 30; ++part) {
      // Every second one is the low byte of the number of records in a page.
      const std::size_t place = part % 2 == 0 ? size / step * part / 30 * step + first + 4 : size * part / 30 + 277;
      flip(folder.file(name), place, static_cast<int>(part % 8));
      int failed = 0;
      for (std::size_t hour = 0; hour < expected.size(); ++hour) {
        const auto found = hour_of(static_cast<std::int64_t>(hour) * kHour_s);
        ASSERT_TRUE(!found || shown(joined(found, 60)) == expected[hour]) << name << " " << place;
        EXPECT_TRUE(found || found.error().text().find("disk image is malformed") != std::string::npos) << place;
        failed += found ? 0 : 1;
      }
      noticed += failed > 0 ? 1 : 0;
      flip(folder.file(name), place, static_cast<int>(part % 8));
    }
    EXPECT_GE(noticed, min_noticed) << name;
  }
  EXPECT_EQ(minutes(store), expected_minutes(kLength_s));
}

TEST_F(PeriodStoreTest, ReplacesAFileThatIsNotADatabase) {
  for (const char* const text : {"{\"version\":1}", "SQLite format 3"}) {
    const test::TemporaryFolder other;
    fs::create_directory(other.file("z"));
    std::ofstream(other.file("z/periods.sqlite")) << text << std::string(9000, 'x');
    EXPECT_NE(opened(other).rebuild_reason(), "");
    EXPECT_EQ(opened(other).rebuild_reason(), "");
  }
}

// Minutes, hours and place.json of prismweb 0.2. The log contains all of their data.
TEST_F(PeriodStoreTest, RemovesTheFilesOfAnOlderVersion) {
  fs::create_directory(folder.file("z"));
  for (const char* const name : {"z/minutes", "z/hours", "z/place.json"}) std::ofstream(folder.file(name)) << "old";
  const PeriodStore store = opened(folder);
  EXPECT_EQ(store.cursor(), "");
  EXPECT_EQ(store.rebuild_reason(), "");
  for (const auto& entry : fs::directory_iterator(folder.file("z")))
    EXPECT_EQ(entry.path().filename().string().rfind("periods.sqlite", 0), 0U) << entry.path();
}

TEST_F(PeriodStoreTest, IsLockedByOneProcess) {
  const PeriodStore store = opened(folder);
  const auto second = PeriodStore::open(folder.file("z"));
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().text().find("periods.sqlite: is in use by another process"), std::string::npos)
      << second.error().text();
}

TEST_F(PeriodStoreTest, ADayIsSmallAndReadInParts) {
  PeriodStore store = opened(folder);
  for (std::int64_t i = 0; i < 86400; i += 1700) {
    push(store, i, std::min<std::int64_t>(i + 1700, 86400),
         "6f0c6f0c6f0c6f0c6f0c6f0c6f0c6f0c-12-" + std::to_string(i) + "-" + std::to_string(i));
    ASSERT_TRUE(store.commit());
  }
  EXPECT_LE(fs::file_size(folder.file("z/periods.sqlite")), 300U << 10);
  EXPECT_LE(fs::file_size(folder.file("z/periods.sqlite-wal")), 1U << 20) << "it does not grow over time";
  const auto part = *store.periods(60, kBegin + 40000 / 60 * 60, kBegin + 50000 / 60 * 60);
  ASSERT_FALSE(part.empty());
  EXPECT_EQ(part.front().begin_s, kBegin + 40000 / 60 * 60);
  EXPECT_EQ(part.size(), 50000U / 60 - 40000 / 60);
  EXPECT_EQ(store.periods(3600, INT64_MIN, INT64_MAX)->size(), 24U);
  EXPECT_EQ(store.periods(1800, INT64_MIN, INT64_MAX)->size(), 144U) << "from ten_minutes";
  EXPECT_EQ(store.periods(900, INT64_MIN, INT64_MAX)->size(), 1440U);
  using Cursors = std::vector<std::string>;
  EXPECT_EQ(store.cursors_before(kBegin + 1), Cursors());
  EXPECT_EQ(store.cursors_before(kBegin + 1700), Cursors{"6f0c6f0c6f0c6f0c6f0c6f0c6f0c6f0c-12-0-0"});
  EXPECT_NE(store.cursors_before(kBegin + 80000), store.cursors_before(kBegin + 1700));
}

// A counter restarted: a time that occurs only in the earlier epoch was searched in the later one and not found.
TEST_F(PeriodStoreTest, ReturnsACursorPerClockEpoch) {
  PeriodStore store = opened(folder);
  const auto keep = [&](std::int64_t from, std::int64_t to, const char* cursor) {
    push(store, from, to, cursor);
    ASSERT_TRUE(store.commit());
  };
  keep(0, 1000, "first-1000");
  keep(1000, 12000, "first-12000");
  keep(5000, 6000, "second-6000");
  using Cursors = std::vector<std::string>;
  EXPECT_EQ(store.cursors_before(kBegin + 7000), (Cursors{"second-6000", "first-1000"}));
  EXPECT_EQ(store.cursors_before(kBegin + 12500), (Cursors{"second-6000", "first-12000"}));
  EXPECT_EQ(store.cursors_before(kBegin + 2000), Cursors{"first-1000"});
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
TEST_F(PeriodStoreTest, AFailedCommitIsRolledBackAndTheNextOneIsComplete) {
  {
    PeriodStore store = opened(folder);
    push(store, 0, 3700, "not written");
    for (const auto& [reason, text] : {std::pair{ENOSPC, "No space left on device"}, {EIO, "Input/output error"}}) {
      const FailingWrites disk(reason);
      const auto done = store.commit();
      ASSERT_FALSE(done);
      EXPECT_NE(done.error().text().find(std::string("periods.sqlite: ") + text), std::string::npos)
          << done.error().text();
      EXPECT_FALSE(store.is_damaged());
      EXPECT_EQ(minutes(store), expected_minutes(3700));
    }
    push(store, 3700, 4000, "after");
    ASSERT_TRUE(store.commit());
    EXPECT_EQ(minutes(store), expected_minutes(4000));
  }
  EXPECT_EQ(minutes(opened(folder)), expected_minutes(4000));
}

// SQLite stores −0 as 0, which had another checksum: such a minute was always reported as damaged.
TEST_F(PeriodStoreTest, StoresMinusZeroAsZero) {
  PeriodStore store = opened(folder);
  PeriodSummary second = at(0);
  second.min[kSlope] = second.max[kSlope] = -0.0;
  store.push({&second, 1}, "after");
  ASSERT_TRUE(store.commit());
  EXPECT_EQ(joined(store.periods(60, INT64_MIN, INT64_MAX), 60).at(0).min[kSlope], 0);
}

TEST_F(PeriodStoreTest, AClockSetBackLosesNoRows) {
  {
    PeriodStore store = opened(folder);
    push(store, 1000, 2000, "first");
    ASSERT_TRUE(store.commit());
    push(store, 500, 1500, "after");
    ASSERT_TRUE(store.commit());
  }
  PeriodStore store = opened(folder);
  std::uint32_t seconds = 0;
  for (const PeriodSummary& one : joined(store.periods(60, INT64_MIN, INT64_MAX), 60)) seconds += one.seconds;
  EXPECT_EQ(seconds, 2000U);
  EXPECT_FALSE(store.periods(60, kBegin + 540, kBegin + 600)->empty());
}

TEST(Paths, StayInTheirDirectoryForAnyName) {
  EXPECT_EQ(path_part("gyro-1.z"), "gyro-1.z");
  EXPECT_EQ(path_part(".."), "%2E.");
  EXPECT_EQ(path_part("a/b"), "a%2Fb");
}

// Earlier bug: a disk without a free inode was reported as "No such file or directory".
TEST_F(PeriodStoreTest, AFileThatCannotBeCreatedHasTheDisksReason) {
  const std::string full = folder.file("full");
  for (const bool with_database : {false, true}) {  // no inode for the database, or none for its log
    std::filesystem::create_directory(full);
    if (::mount("tmpfs", full.c_str(), "tmpfs", 0, "size=1m,nr_inodes=2") != 0) GTEST_SKIP() << "needs root, to mount";
    if (!with_database) std::ofstream(full + "/other") << "text";
    const auto store = PeriodStore::open(full);
    const std::string reason = store ? "" : store.error().text();
    ::umount(full.c_str());
    EXPECT_EQ(reason, full + "/periods.sqlite: No space left on device") << with_database;
  }
}

}  // namespace
}  // namespace prism::prismweb
