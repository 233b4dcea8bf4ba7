// SPDX-License-Identifier: MIT
// Captures are read back to the nanosecond; truncation, damage and other files are reported in one line.
#include "drivers/capture_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "base/file.hpp"
#include "tests/support/document.hpp"
#include "tests/support/full_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::drivers {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Kept {
  std::int64_t time_ns;
  drivers::CaptureEvent event;
  Bytes bytes;
  bool operator==(const Kept&) const = default;
};

std::vector<Kept> read_all(CaptureReader& reader) {
  std::vector<Kept> all;
  while (const auto packet = reader.next()) {
    all.push_back({packet->time_ns, packet->event, Bytes(packet->bytes.begin(), packet->bytes.end())});
  }
  return all;
}

Bytes file_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(in), {});
}

void write_bytes(const std::string& path, const Bytes& bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

const std::vector<Kept> kStory{{1'700'000'000'000'000'000, drivers::CaptureEvent::kOpened, {}},
                               {1'700'000'000'005'000'001, drivers::CaptureEvent::kData, {1, 2, 3}},
                               {1'700'000'000'999'999'999, drivers::CaptureEvent::kData, Bytes(300, 0xA5)},
                               {1'700'000'002'000'000'000, drivers::CaptureEvent::kOpened, {}},
                               {1'700'000'002'000'000'007, drivers::CaptureEvent::kData, {9}}};

void write_story(const std::string& path) {
  auto writer = CaptureWriter::open(path);
  ASSERT_TRUE(writer) << writer.error().text();
  for (const Kept& kept : kStory) {
    ASSERT_TRUE(kept.event == drivers::CaptureEvent::kOpened ? writer->opened(kept.time_ns)
                                                             : writer->data(kept.time_ns, kept.bytes));
  }
  ASSERT_TRUE(writer->flush(true));
  EXPECT_EQ(writer->bytes_written(), std::filesystem::file_size(path));
}

struct CaptureFileTest : testing::Test {
  const test::TemporaryFolder folder;
};

TEST_F(CaptureFileTest, ReturnsEveryPacketToTheNanosecond) {
  write_story(folder.file("a.pcap"));
  auto reader = CaptureReader::open(folder.file("a.pcap"));
  ASSERT_TRUE(reader) << reader.error().text();
  EXPECT_EQ(read_all(*reader), kStory);
  EXPECT_EQ(reader->tail_damage(), "");
  EXPECT_EQ(reader->position_bytes(), reader->size_bytes());
}

// The layout by hand: file header of 24 bytes, packet header of 16, then the 12 bytes of the record.
TEST_F(CaptureFileTest, IsPcapOfLinkType250WithNanoseconds) {
  write_story(folder.file("a.pcap"));
  const Bytes bytes = file_bytes(folder.file("a.pcap"));
  ASSERT_GT(bytes.size(), 24u + 28 + 31);
  EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + 4), (Bytes{0x4D, 0x3C, 0xB2, 0xA1}));
  EXPECT_EQ(bytes[20], 250);
  const Bytes second(bytes.begin() + 24 + 28, bytes.begin() + 24 + 28 + 31);
  EXPECT_EQ(Bytes(second.begin(), second.begin() + 8), (Bytes{0x00, 0xF1, 0x53, 0x65, 0x41, 0x4B, 0x4C, 0x00}));
  // 1 700 000 000 s = 6553F100h, 5000 us = 1388h, event 2, control lines 0, two zero bytes, the line's three bytes
  EXPECT_EQ(Bytes(second.begin() + 16, second.end()),
            (Bytes{0x65, 0x53, 0xF1, 0x00, 0x00, 0x00, 0x13, 0x88, 2, 0, 0, 0, 1, 2, 3}));
}

TEST_F(CaptureFileTest, KeepsChunksOfAnySize) {
  Bytes large(200'000);
  for (std::size_t i = 0; i < large.size(); ++i) large[i] = static_cast<std::uint8_t>(i * 7);
  {
    auto writer = CaptureWriter::open(folder.file("a.pcap"));
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->data(5, large));
  }
  auto reader = CaptureReader::open(folder.file("a.pcap"));
  ASSERT_TRUE(reader);
  Bytes again;
  for (const Kept& kept : read_all(*reader)) {
    EXPECT_EQ(kept.time_ns, 5);
    again.insert(again.end(), kept.bytes.begin(), kept.bytes.end());
  }
  EXPECT_EQ(again, large);
}

// A power cut leaves any length: all complete packets are read, and the truncation is reported.
TEST_F(CaptureFileTest, ReturnsAllPacketsBeforeATruncation) {
  write_story(folder.file("a.pcap"));
  const Bytes whole = file_bytes(folder.file("a.pcap"));
  std::vector<std::size_t> ends{24};
  for (const Kept& kept : kStory) ends.push_back(ends.back() + 16 + 12 + kept.bytes.size());
  for (std::size_t cut = 4; cut < whole.size(); ++cut) {
    write_bytes(folder.file("cut.pcap"), Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut)));
    auto reader = CaptureReader::open(folder.file("cut.pcap"));
    ASSERT_TRUE(reader) << cut << ": " << reader.error().text();
    const std::vector<Kept> found = read_all(*reader);
    std::size_t expected = 0;
    bool clean = false;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (ends[i] <= cut) expected = i;
      clean = clean || ends[i] == cut;
    }
    ASSERT_EQ(found, std::vector<Kept>(kStory.begin(), kStory.begin() + static_cast<std::ptrdiff_t>(expected))) << cut;
    ASSERT_EQ(reader->tail_damage().empty(), clean) << cut << ": " << reader->tail_damage();
    ASSERT_FALSE(reader->next());
  }
}

// After any damage to one packet its neighbours are read once, and the damage is reported.
TEST_F(CaptureFileTest, ContinuesAfterDamage) {
  write_story(folder.file("a.pcap"));
  const Bytes whole = file_bytes(folder.file("a.pcap"));
  ASSERT_GE(kStory.size(), 4u);
  const auto second = static_cast<std::ptrdiff_t>(24 + 28 + kStory[0].bytes.size());
  const auto third = second + static_cast<std::ptrdiff_t>(28 + kStory[1].bytes.size());
  const auto recovers = [&](const Bytes& bytes, const char* what, std::uint64_t lost, std::size_t packets_lost) {
    write_bytes(folder.file("b.pcap"), bytes);
    auto reader = CaptureReader::open(folder.file("b.pcap"));
    ASSERT_TRUE(reader) << what;
    std::vector<Kept> expected = kStory;
    expected.erase(expected.begin() + 1, expected.begin() + 1 + static_cast<std::ptrdiff_t>(packets_lost));
    EXPECT_EQ(read_all(*reader), expected) << what;
    EXPECT_EQ(reader->damaged_places().count, 1u) << what;
    EXPECT_EQ(reader->damaged_places().bytes, lost) << what;
    EXPECT_EQ(reader->damaged_places().first, static_cast<std::uint64_t>(second)) << what;
    EXPECT_EQ(reader->tail_damage(), "") << what;
  };
  const auto packet = static_cast<std::uint64_t>(third - second);
  for (std::ptrdiff_t at = second; at < second + 28; ++at) {
    if (at == second + 24) continue;  // the event type has no copy
    Bytes bytes = whole;
    bytes[static_cast<std::size_t>(at)] ^= 0xFF;
    // Nanoseconds below a microsecond have no copy.
    if (at == second + 4) bytes[static_cast<std::size_t>(at + 1)] ^= 0xFF;
    recovers(bytes, ("byte " + std::to_string(at - second)).c_str(), packet, 1);
  }
  for (const int size : {1, 27, 28, 5000, 70'000}) {
    Bytes bytes = whole, garbage;
    for (int i = 0; i < size; ++i) garbage.push_back(static_cast<std::uint8_t>(i * 37 + i / 256));
    bytes.insert(bytes.begin() + second, garbage.begin(), garbage.end());
    recovers(bytes, (std::to_string(size) + " bytes put in").c_str(), static_cast<std::uint64_t>(size), 0);
  }
  Bytes cut = whole;
  cut.erase(cut.begin() + second + 3, cut.begin() + third - 1);
  recovers(cut, "cut out", 4, 1);
}

TEST_F(CaptureFileTest, EndsIfNoPacketFollowsTheDamage) {
  write_story(folder.file("a.pcap"));
  Bytes bytes = file_bytes(folder.file("a.pcap"));
  bytes.insert(bytes.end(), 100'000, 0x55);
  write_bytes(folder.file("a.pcap"), bytes);
  auto reader = CaptureReader::open(folder.file("a.pcap"));
  ASSERT_TRUE(reader);
  EXPECT_EQ(read_all(*reader), kStory);
  EXPECT_EQ(reader->damaged_places().count, 0u);
  EXPECT_NE(reader->tail_damage().find("a.pcap: "), std::string::npos);
}

TEST_F(CaptureFileTest, SkipsAndCountsShortPackets) {
  write_story(folder.file("a.pcap"));
  Bytes bytes = file_bytes(folder.file("a.pcap"));
  const Bytes header{0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 3, 0, 0, 0, 7, 7, 7};
  bytes.insert(bytes.begin() + 24, header.begin(), header.end());
  write_bytes(folder.file("a.pcap"), bytes);
  auto reader = CaptureReader::open(folder.file("a.pcap"));
  ASSERT_TRUE(reader);
  EXPECT_EQ(read_all(*reader), kStory);
  EXPECT_EQ(reader->foreign_packets(), 1u);
}

TEST_F(CaptureFileTest, RejectsOtherFilesInOneLine) {
  write_bytes(folder.file("log.csv"), Bytes(40, 'x'));
  write_bytes(folder.file("empty"), {});
  write_story(folder.file("ethernet.pcap"));
  Bytes bytes = file_bytes(folder.file("ethernet.pcap"));
  bytes[20] = 1;
  write_bytes(folder.file("ethernet.pcap"), bytes);
  const auto refusal = [&](const std::string& name) {
    const auto reader = CaptureReader::open(folder.file(name));
    return reader ? "taken" : reader.error().text().substr(folder.file("").size());
  };
  EXPECT_EQ(refusal("log.csv"), "log.csv: not a pcap file (40 bytes), expected a capture of link type 250");
  EXPECT_EQ(refusal("empty"), "empty: not a pcap file (0 bytes), expected a capture of link type 250");
  EXPECT_EQ(
      refusal("ethernet.pcap"),
      "ethernet.pcap: found a capture of link type 1 (EN10MB), expected 250 (serial line); to extract bytes of TCP: "
      "tshark -r FILE -Y tcp.payload -T fields -e tcp.payload | xxd -r -p >BYTES");
  EXPECT_EQ(refusal("absent.pcap"), "absent.pcap: cannot be read: No such file or directory");
  EXPECT_EQ(refusal("."), ".: is a directory, expected a capture (a .pcap file, or raw bytes)");
}

TEST_F(CaptureFileTest, ReplaysRawBytesAtTheGivenRate) {
  Bytes bytes(5000);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i);
  write_bytes(folder.file("line.bin"), bytes);
  auto reader = CaptureReader::open(folder.file("line.bin"), 2000);
  ASSERT_TRUE(reader) << reader.error().text();
  EXPECT_TRUE(reader->is_bare());
  Bytes again;
  std::int64_t last_ns = 0;
  for (const Kept& kept : read_all(*reader)) {
    EXPECT_LE(kept.bytes.size(), 20u);  // 10 ms at 2000 bytes/s
    again.insert(again.end(), kept.bytes.begin(), kept.bytes.end());
    last_ns = kept.time_ns;
    EXPECT_EQ(kept.time_ns, static_cast<std::int64_t>(again.size()) * 500'000);
  }
  EXPECT_EQ(again, bytes);
  EXPECT_EQ(last_ns, 2'500'000'000);
}

TEST_F(CaptureFileTest, ReportsAFullDiskInEveryCall) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full (Linux)";
  const auto writer = CaptureWriter::adopt(::open("/dev/full", O_WRONLY | O_CLOEXEC), "/dev/full", nullptr);
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().text(), "/dev/full: cannot be written: No space left on device");
}

TEST_F(CaptureFileTest, KeepsWrittenPacketsWhenTheDiskFillsUp) {
  std::string first, again;
  {
    const test::FullDisk disk(5000);
    auto writer = CaptureWriter::open(folder.file("a.pcap"));
    for (int i = 0; writer && i < 100; ++i) {
      auto done = writer->data(i, Bytes(100, 1));
      if (done) done = writer->flush();
      if (!done && first.empty()) first = done.error().what;
      if (!done) again = done.error().what;
    }
  }
  EXPECT_EQ(first, "cannot be written: File too large");
  EXPECT_EQ(again, first);
  auto reader = CaptureReader::open(folder.file("a.pcap"));
  ASSERT_TRUE(reader);
  EXPECT_EQ(read_all(*reader).size(), (5000u - 24) / (16 + 12 + 100));
  EXPECT_NE(reader->tail_damage(), "");
}

// A full pipe takes a part, and the rest after it was read.
TEST_F(CaptureFileTest, ContinuesBehindTheWrittenBytes) {
  Bytes large(200'000), found;
  for (std::size_t i = 0; i < large.size(); ++i) large[i] = static_cast<std::uint8_t>(i * 7 + i / 256);
  int ends[2] = {-1, -1};
  ASSERT_EQ(::pipe2(ends, O_NONBLOCK | O_CLOEXEC), 0);
  const Descriptor reader(ends[0]);
  const auto take = [&] {
    std::array<std::uint8_t, 4096> part;
    for (ssize_t got; (got = ::read(reader.get(), part.data(), part.size())) > 0;)
      found.insert(found.end(), part.begin(), part.begin() + got);
  };
  int times = 0;
  {
    auto writer = CaptureWriter::adopt(ends[1], "pipe", [&](int error) {
      EXPECT_EQ(error, EAGAIN);
      take();
      return ++times < 100;
    });
    ASSERT_TRUE(writer && writer->data(5, large) && writer->flush());
  }
  take();
  EXPECT_GT(times, 1);
  {
    auto writer = CaptureWriter::open(folder.file("a.pcap"));
    ASSERT_TRUE(writer && writer->data(5, large));
    EXPECT_EQ(writer->bytes_written(), found.size());
  }
  EXPECT_TRUE(found == file_bytes(folder.file("a.pcap")));
}

// Without flush() the buffer is written within a megabyte.
TEST_F(CaptureFileTest, DetectsAFullDiskWithoutFlush) {
  const test::FullDisk disk(5000);
  auto writer = CaptureWriter::open(folder.file("a.pcap"));
  ASSERT_TRUE(writer);
  int written = 0;
  while (written < 10'000 && writer->data(written, Bytes(100, 1))) ++written;
  EXPECT_LT(written, 10'000);
  EXPECT_FALSE(writer->flush());
}

TEST_F(CaptureFileTest, ReportsAFileThatCannotBeCreated) {
  const auto writer = CaptureWriter::open("/nowhere/a.pcap");
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().text(), "/nowhere/a.pcap: cannot be written: No such file or directory");
}

// The pairs of hex digits at the start of each line of the example, up to the first double space.
std::string documented_bytes() {
  std::string section = test::document_section("formats.md", "## The capture");
  section.erase(0, std::min(section.find("<!-- hex"), section.size()));
  std::istringstream lines(section);
  std::string bytes, line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.rfind("    ", 0) == 0) {
    std::istringstream pairs(line.substr(4, line.find("  ", 4) - 4));
    for (std::string pair; pairs >> pair;) bytes += static_cast<char>(std::stoi(pair, nullptr, 16));
  }
  return bytes;
}

TEST(FormatsDocument, ShowsTheBytesOfTheWriter) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("written.pcap");
  {
    auto writer = CaptureWriter::open(path);
    ASSERT_TRUE(writer) << writer.error().text();
    constexpr std::int64_t kOpened = 1'795'425'060'000'000'000;
    const std::array<std::uint8_t, 3> bytes = {0x24, 0x58, 0x07};
    ASSERT_TRUE(writer->opened(kOpened));
    ASSERT_TRUE(writer->data(kOpened + 4'200'125, bytes));
    ASSERT_TRUE(writer->flush());
  }
  const std::string written = test::read_file(path);
  ASSERT_FALSE(written.empty());
  EXPECT_EQ(written, documented_bytes());
}

}  // namespace
}  // namespace prism::drivers
