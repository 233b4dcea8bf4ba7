// SPDX-License-Identifier: MIT
#include "tools/prismweb/store.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismweb/archive.hpp"

namespace prism::prismweb {
namespace {

namespace fs = std::filesystem;
constexpr std::int64_t kBegin = 1795425000 / 3600 * 3600;

Extremes at(std::int64_t i) {
  Extremes one;
  one.begin_s = kBegin + i;
  one.least[kRate] = one.greatest[kRate] = std::sin(static_cast<double>(i) * 0.37) * static_cast<double>(i % 97);
  if (i % 5 != 0) one.mean[kRate].take(one.least[kRate]);
  one.samples = 1000;
  one.seconds = one.good = 1;
  return one;
}

Store opened(const test::TemporaryFolder& folder) {
  auto store = Store::open(folder.file("z"));
  EXPECT_TRUE(store) << store.error().text();
  return std::move(*store);
}

void push(Store& store, std::int64_t from, std::int64_t to) {
  for (std::int64_t i = from; i < to; ++i) store.push(at(i));
}

std::string shown(const std::vector<Extremes>& periods) {
  std::string text;
  for (const Extremes& one : periods)
    text += std::to_string(one.begin_s - kBegin) + ":" + std::to_string(one.least[kRate]) + "/" +
            std::to_string(one.greatest[kRate]) + "*" + std::to_string(one.seconds) + "," +
            std::to_string(one.samples) + "m" + std::to_string(one.mean[kRate].known) + "~" +
            std::to_string(std::lround(1000 * one.mean[kRate].value())) + " ";
  return text;
}
std::string minutes(const Store& store) { return shown(store.minutes(INT64_MIN, INT64_MAX)); }

// The answer that a store must give which was never closed.
std::string whole(std::int64_t to) {
  std::vector<Extremes> seconds;
  for (std::int64_t i = 0; i < to; ++i) seconds.push_back(at(i));
  return shown(thinned(seconds, INT64_MIN, INT64_MAX, 60));
}

TEST(Store, GoesOnWhereItWasClosed) {
  const test::TemporaryFolder folder;
  std::string cursor;
  for (std::int64_t i = 0; i < 1000; i += 37) {
    Store store = opened(folder);
    EXPECT_EQ(store.cursor(), cursor);
    push(store, i, i + 37);
    cursor = "after-" + std::to_string(i + 37);
    ASSERT_TRUE(store.commit(cursor));
  }
  const Store store = opened(folder);
  EXPECT_EQ(minutes(store), whole(1036));
  EXPECT_EQ(shown(store.hours(INT64_MIN, INT64_MAX)).substr(0, 2), "0:");
  EXPECT_EQ(store.first_second(), kBegin);
  EXPECT_EQ(store.last_second(), kBegin + 1035);
}

// What was pushed and not kept is gone with the process, and so is the place: the same rows come again.
TEST(Store, WhatWasNotKeptIsMadeAgainFromTheLog) {
  const test::TemporaryFolder folder;
  {
    Store store = opened(folder);
    push(store, 0, 500);
    ASSERT_TRUE(store.commit("after-500"));
    push(store, 500, 900);
  }
  // Killed in the middle of writing: records and a half that nothing acknowledged.
  std::ofstream(folder.file("z/minutes"), std::ios::app | std::ios::binary) << std::string(200, 'x');
  Store store = opened(folder);
  EXPECT_EQ(store.cursor(), "after-500");
  EXPECT_EQ(store.begun_anew(), "");
  push(store, 500, 1000);
  ASSERT_TRUE(store.commit("after-1000"));
  EXPECT_EQ(minutes(store), whole(1000));
  EXPECT_EQ(minutes(opened(folder)), whole(1000));
}

TEST(Store, BeginsAnewWhereItIsDamaged) {
  const auto damages = std::vector<std::function<void(const std::string&)>>{
      [](const std::string& z) { fs::resize_file(z + "/minutes", kRecordBytes * 3 + 5); },
      [](const std::string& z) {
        std::fstream file(z + "/minutes", std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(static_cast<std::streamoff>(fs::file_size(z + "/minutes") - 20));
        file.put('\x55');
      },
      [](const std::string& z) {  // a record in the middle
        std::fstream file(z + "/minutes", std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(kRecordBytes * 5 + 12);
        file.put('\x55');
      },
      [](const std::string& z) { std::ofstream(z + "/place.json") << "{\"version\":1,"; },
      [](const std::string& z) { std::ofstream(z + "/place.json") << "{\"version\":2}"; },
      [](const std::string& z) { fs::remove(z + "/place.json"); },
      [](const std::string& z) { fs::remove(z + "/hours"); }};
  for (std::size_t i = 0; i < damages.size(); ++i) {
    const test::TemporaryFolder folder;
    {
      Store store = opened(folder);
      push(store, 0, 8000);
      ASSERT_TRUE(store.commit("after"));
    }
    damages[i](folder.file("z"));
    Store store = opened(folder);
    EXPECT_EQ(store.cursor(), "") << i;
    EXPECT_NE(store.begun_anew(), "") << i;
    EXPECT_EQ(minutes(store), "") << i;
    push(store, 0, 100);
    ASSERT_TRUE(store.commit("after-100"));
    EXPECT_EQ(minutes(opened(folder)), whole(100)) << i;
  }
}

TEST(Store, ADayOfMinutesIsSmallAndReadInParts) {
  const test::TemporaryFolder folder;
  Store store = opened(folder);
  for (std::int64_t i = 0; i < 86400; i += 1700) {
    push(store, i, std::min<std::int64_t>(i + 1700, 86400));
    ASSERT_TRUE(store.commit("6f0c6f0c6f0c6f0c6f0c6f0c6f0c6f0c-12-" + std::to_string(i) + "-" + std::to_string(i)));
  }
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(folder.file("z"))) bytes += entry.file_size();
  EXPECT_LE(bytes, 200U << 10);
  const auto part = store.minutes(kBegin + 40000 / 60 * 60, kBegin + 50000 / 60 * 60);
  ASSERT_FALSE(part.empty());
  EXPECT_EQ(part.front().begin_s, kBegin + 40000 / 60 * 60);
  EXPECT_EQ(part.size(), 50000U / 60 - 40000 / 60);
  EXPECT_EQ(store.hours(INT64_MIN, INT64_MAX).size(), 24U);
  using Cursors = std::vector<std::string>;
  EXPECT_EQ(store.cursors_before(kBegin + 1), Cursors());
  EXPECT_EQ(store.cursors_before(kBegin + 1700), Cursors{"6f0c6f0c6f0c6f0c6f0c6f0c6f0c6f0c-12-0-0"});
  EXPECT_NE(store.cursors_before(kBegin + 80000), store.cursors_before(kBegin + 1700));
}

// A counter that began anew: a time that only the earlier run had was sought in the later one, and not found.
TEST(Store, KnowsAPlaceInEachRunOfAClock) {
  const test::TemporaryFolder folder;
  Store store = opened(folder);
  const auto keep = [&](std::int64_t from, std::int64_t to, const char* cursor) {
    push(store, from, to);
    ASSERT_TRUE(store.commit(cursor));
  };
  keep(0, 1000, "first-1000");
  keep(1000, 12000, "first-12000");
  keep(5000, 6000, "second-6000");
  using Cursors = std::vector<std::string>;
  EXPECT_EQ(store.cursors_before(kBegin + 7000), (Cursors{"second-6000", "first-1000"}));
  EXPECT_EQ(store.cursors_before(kBegin + 12500), (Cursors{"second-6000", "first-12000"}));
  EXPECT_EQ(store.cursors_before(kBegin + 2000), Cursors{"first-1000"});
}

// In the place of the file under a descriptor of this process, until it goes: one that cannot be written.
class ReadOnly {
 public:
  explicit ReadOnly(const std::string& path) {
    for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
      std::error_code gone;
      if (fs::read_symlink(entry.path(), gone) == fs::path(path)) fd_ = std::stoi(entry.path().filename());
    }
    EXPECT_GE(fd_, 0) << path;
    kept_ = ::dup(fd_);
    const int other = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    ::dup2(other, fd_);
    ::close(other);
  }
  ~ReadOnly() {
    ::dup2(kept_, fd_);
    ::close(kept_);
  }

 private:
  int fd_ = -1, kept_ = -1;
};

// Eight seconds of a failing disk: each try appended the same minutes, and a minute had 300 seconds from then on.
TEST(Store, ACommitThatFailsHalfwayIsNoneAndTheNextOneIsWhole) {
  const test::TemporaryFolder folder;
  Store store = opened(folder);
  push(store, 0, 3700);
  for (int i = 0; i < 3; ++i) {
    const ReadOnly hours(folder.file("z/hours"));
    EXPECT_FALSE(store.commit("refused"));
    EXPECT_EQ(minutes(store), whole(3700)) << i;
  }
  push(store, 3700, 4000);
  ASSERT_TRUE(store.commit("after"));
  EXPECT_EQ(minutes(store), whole(4000));
  EXPECT_EQ(minutes(opened(folder)), whole(4000));
}

TEST(Store, AClockThatWasSetBackLosesNothing) {
  const test::TemporaryFolder folder;
  {
    Store store = opened(folder);
    push(store, 1000, 2000);
    push(store, 500, 1500);
    ASSERT_TRUE(store.commit("after"));
  }
  std::uint32_t seconds = 0;
  for (const Extremes& one : opened(folder).minutes(INT64_MIN, INT64_MAX)) seconds += one.seconds;
  EXPECT_EQ(seconds, 2000U);
  EXPECT_FALSE(opened(folder).minutes(kBegin + 540, kBegin + 600).empty());
}

TEST(Paths, OfNamesLeaveTheirFolderByNoName) {
  EXPECT_EQ(path_part("gyro-1.z"), "gyro-1.z");
  EXPECT_EQ(path_part(".."), "%2E.");
  EXPECT_EQ(path_part("a/b"), "a%2Fb");
}

}  // namespace
}  // namespace prism::prismweb
