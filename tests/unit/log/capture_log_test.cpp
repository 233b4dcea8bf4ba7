// SPDX-License-Identifier: MIT
// The capture has every byte with its time, or counts the missing ones and begins a new session after the gap.
#include "daemon/log/capture_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <future>

#include "drivers/capture_file.hpp"
#include "tests/support/disk_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/log/failing_calls.hpp"

namespace prism::log {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kNoonNs = 1'795'262'400 * kSecond;  // 2026-11-21T12:00:00Z
using Bytes = std::vector<std::uint8_t>;

struct CaptureLogTest : testing::Test {
  void SetUp() override { begin(); }
  void begin(const std::string& name = "gyro") {
    log.reset();
    log = std::make_unique<CaptureLog>(settings, name, disk, told.problems, CaptureLog::kMostHeld,
                                       SegmentPolicy{told.events(), true, 60, [] { return 0; }});
  }
  void data(double second, const Bytes& bytes) { log->data(bytes, kNoonNs + static_cast<std::int64_t>(second * 1e9)); }
  void flush() {
    log->flush();
    disk.drain();
  }
  // A segment's packets: "|" is a mark, else the bytes as they are.
  std::string packets(const std::string& name) const {
    auto reader = drivers::CaptureReader::open(settings.directory + "/" + name);
    EXPECT_TRUE(reader) << name;
    std::string text;
    while (const auto packet = reader ? reader->next() : std::nullopt) {
      if (packet->event == drivers::CaptureEvent::kOpened) text += '|';
      text.append(packet->bytes.begin(), packet->bytes.end());
    }
    return text;
  }

  const test::TemporaryFolder folder;
  config::LogSegmentSettings settings = test::segments_in(folder.file("capture"));
  test::Told told, unanswered;
  DiskThread disk{1000, unanswered.teller()};
  std::unique_ptr<CaptureLog> log;
};

TEST_F(CaptureLogTest, KeepsBytesAndMarksInOrder) {
  log->mark_opened(kNoonNs);
  data(0.1, {'a', 'b'});
  data(0.2, {'c'});
  log->mark_opened(kNoonNs + kSecond);
  data(1.1, {'d'});
  log.reset();
  disk.drain();
  EXPECT_EQ(packets("gyro-000001-20261121T120000Z-0s.pcap"), "|abc|d");
  EXPECT_THAT(told.lines(), IsEmpty());
}

TEST_F(CaptureLogTest, StandsOnTheDiskASecondLaterWithoutBeingAsked) {
  data(0, {'a'});
  data(0.5, {'b'});
  disk.drain();
  EXPECT_THAT(test::files_in(settings.directory), IsEmpty());
  data(1.0, {'c'});
  disk.drain();
  EXPECT_EQ(packets("gyro-000001-20261121T120000Z-0s.pcap"), "abc");
}

TEST_F(CaptureLogTest, BeginsASegmentWhereTheFirstIsFull) {
  settings.max_bytes = 200;
  begin();
  for (int i = 0; i < 3; ++i) data(i, Bytes(100, 'x'));
  flush();
  EXPECT_THAT(test::files_in(settings.directory),
              ElementsAre("gyro-000001-20261121T120000Z-0s.pcap", "gyro-000002-20261121T120001Z-0s.pcap",
                          "gyro-000003-20261121T120002Z-0s.pcap"));
}

TEST_F(CaptureLogTest, WhatTheQueueCannotTakeIsCountedToldOnceAndMarked) {
  std::promise<void> gate;
  disk.post(0, [&] { gate.get_future().wait(); });
  data(0, {'a'});
  log->flush();
  for (int i = 0; i < 3; ++i) {
    data(1, Bytes(2000, 'x'));
    log->flush();
  }
  EXPECT_EQ(log->dropped_bytes(), 6000u) << "known at once, although the disk is blocked";
  gate.set_value();
  disk.drain();
  for (const char byte : {'b', 'c', 'd'}) {
    data(2, {static_cast<std::uint8_t>(byte)});
    flush();
  }
  EXPECT_EQ(packets("gyro-000001-20261121T120000Z-0s.pcap"), "a|bcd") << "the mark is at the gap";
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("capture: the disk cannot keep up with the line; bytes are dropped"),
                                        "capture: writing again after 6000 bytes were dropped"));
}

TEST_F(CaptureLogTest, AFailedSyncCostsNoByteAndIsToldOnce) {
  data(0, {'a'});
  flush();
  {
    const test::FailingCall fault(test::failing_fdatasync, EIO);
    data(1, {'b'});
    flush();
    data(2, {'c'});
    flush();
  }
  for (const char byte : {'d', 'e', 'f'}) {
    data(3, {static_cast<std::uint8_t>(byte)});
    flush();
  }
  EXPECT_EQ(packets("gyro-000001-20261121T120000Z-0s.pcap"), "a") << "ends where its last good sync was";
  EXPECT_EQ(packets("gyro-000002-20261121T120001Z-0s.pcap"), "bcdef");
  EXPECT_THAT(test::files_in(settings.directory), testing::SizeIs(2)) << "no segment without valid data";
  EXPECT_EQ(log->dropped_bytes(), 0u);
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("cannot be written: Input/output error"),
                                        "capture: writing again after 0 bytes were dropped"));
}

TEST_F(CaptureLogTest, AFaultOfADayTriesSeldomAndDropsTheOldest) {
  log = std::make_unique<CaptureLog>(settings, "gyro", disk, told.problems, 100,
                                     SegmentPolicy{nullptr, true, 60, [] { return 0; }});
  {
    const test::FailingCall fault(test::failing_fdatasync, EIO);
    for (int i = 0; i < 100; ++i) {
      data(i, Bytes(10, 'x'));
      flush();
    }
  }
  EXPECT_THAT(test::files_in(settings.directory), IsEmpty());
  EXPECT_EQ(log->dropped_bytes(), 900u);
  for (int i = 100; i < 170; ++i) {
    data(i, {static_cast<std::uint8_t>('0' + i % 10)});
    flush();
  }
  EXPECT_THAT(packets("gyro-000001-20261121T120133Z-0s.pcap"), AllOf(StartsWith("|xxxxxxxxxx"), EndsWith("789")));
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("Input/output error"), HasSubstr("writing again after ")));
}

TEST_F(CaptureLogTest, AFolderThatIsAFileIsAFaultUntilItIsGone) {
  test::write_file(settings.directory, "in the way");
  for (int i = 0; i < 3; ++i) {
    data(i, {'x'});
    flush();
  }
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("cannot be created: Not a directory")));
  std::filesystem::remove(settings.directory);
  data(3, {'a'});
  flush();
  EXPECT_EQ(packets("gyro-000001-20261121T120000Z-0s.pcap"), "xxxa");
  EXPECT_EQ(log->dropped_bytes(), 0u);
}

TEST_F(CaptureLogTest, ANameTooLongIsAFaultAndNoEnd) {
  begin(std::string(250, 'n'));
  data(0, {'a', 'b'});
  flush();
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("File name too long")));
}

TEST_F(CaptureLogTest, ADeletedFolderIsNoticedAndMadeAnew) {
  data(0, {'a'});
  flush();
  std::filesystem::remove_all(settings.directory);
  data(1, {'b'});
  flush();
  EXPECT_THAT(told.lines(), ElementsAre(AllOf(HasSubstr("capture: "), HasSubstr("was deleted or moved away"))));
  data(2, {'c'});
  flush();
  EXPECT_EQ(packets("gyro-000002-20261121T120001Z-0s.pcap"), "bc") << "data of the deleted segment were written again";
}

TEST_F(CaptureLogTest, NeverWritesThroughALink) {
  std::filesystem::create_directory(settings.directory);
  std::filesystem::create_symlink(folder.file("target"), settings.directory + "/gyro-000001-20261121T120000Z-0s.pcap");
  data(0, {'a'});
  flush();
  EXPECT_FALSE(std::filesystem::exists(folder.file("target")));
  EXPECT_EQ(packets("gyro-000002-20261121T120000Z-0s.pcap"), "a");
}

TEST_F(CaptureLogTest, AFullDiskLeavesNoEmptyFilesAndNoHole) {
  {
    const test::FailingCall fault(test::failing_write, ENOSPC);
    for (int i = 0; i < 3; ++i) {
      data(i, {'x'});
      flush();
    }
  }
  EXPECT_THAT(test::files_in(settings.directory), IsEmpty());
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("cannot be written: No space left on device")));
  data(3, {'y'});
  flush();
  EXPECT_EQ(packets("gyro-000001-20261121T120000Z-0s.pcap"), "xxxy") << "kept until there was space";
}

// Earlier bug: "when_full" worked for the log only, not for the capture.
TEST_F(CaptureLogTest, AFullDiskCostsTheOldestSegmentAndNoByteWhereTheConfigurationSaysSo) {
  settings.delete_when_full = true;
  settings.max_age_s = 1;
  begin();
  for (int i = 0; i < 3; ++i) {
    data(i, {'x'});
    flush();
  }
  {
    const test::FailingCall fault(test::failing_write, ENOSPC, 1);
    data(2.5, {'y'});
    flush();
  }
  EXPECT_THAT(test::files_in(settings.directory),
              ElementsAre("gyro-000002-20261121T120001Z-0s.pcap", "gyro-000003-20261121T120002Z-0s.pcap"));
  EXPECT_EQ(packets("gyro-000003-20261121T120002Z-0s.pcap"), "xy");
  EXPECT_EQ(log->dropped_bytes(), 0u);
  EXPECT_THAT(told.lines(), IsEmpty());
}

}  // namespace
}  // namespace prism::log
