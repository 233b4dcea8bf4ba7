// SPDX-License-Identifier: MIT
// Hex dumps of terminal programs and tools give the bytes that were dumped.
#include "drivers/hex_dump.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

namespace prism::drivers {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes truth() {
  Bytes bytes;
  for (int i = 0; i < 96; ++i) bytes.push_back(static_cast<std::uint8_t>(i * 37 + 0xA5));
  return bytes;
}

std::string hex(const Bytes& bytes, std::size_t begin, std::size_t count, const char* separator = " ") {
  std::string text;
  for (std::size_t i = begin; i < begin + count; ++i)
    text += fmt::format("{}{:02X}", i > begin ? separator : "", bytes[i]);
  return text;
}

/// Lines of 16 bytes, each by `line(offset, bytes as text)`.
template <class Write>
std::string dump(Write line, const char* separator = " ") {
  std::string text;
  for (std::size_t i = 0; i < 96; i += 16) text += line(i, hex(truth(), i, 16, separator)) + "\n";
  return text;
}

TEST(HexDump, ReadsTheFormsOfPrograms) {
  const std::string forms[] = {
      dump([](std::size_t, const std::string& b) { return b; }),
      dump([](std::size_t, const std::string& b) { return b + "\r"; }),
      dump([](std::size_t, const std::string& b) { return "0x" + b; }, ", 0x"),
      dump([](std::size_t i, const std::string& b) { return fmt::format("{:08x}: {}  .Z.a 12 34 ..", i, b); }),
      dump([](std::size_t i, const std::string& b) { return fmt::format("{:08x}: {}  .Z|a 12 |4 ..", i, b); }),
      dump([](std::size_t i, const std::string& b) { return fmt::format("{:08x}  {}  |.Z|a 12 ..|", i, b); }) +
          "00000060\n",
      dump([](std::size_t i, const std::string& b) {
        return fmt::format("< 2024/03/01 12:00:05.{:06}  length=16 from={} to={}\n {}", i, i, i + 15, b);
      }),
      dump([](std::size_t, const std::string& b) { return "01.03.2024 12:00:05.123 [RX] - " + b; }),
      dump([](std::size_t, const std::string& b) { return "[2024-03-01 12:00:05.123] " + b; }),
  };
  for (const std::string& form : forms) {
    const auto bytes = bytes_of_hex_dump(form);
    ASSERT_TRUE(bytes) << form;
    EXPECT_EQ(*bytes, truth()) << form;
  }
}

TEST(HexDump, ReadsXxdInGroupsOfTwo) {
  const auto bytes =
      bytes_of_hex_dump("00000000: a55a 0001 0203 0405 0607 0809 0a0b 0c0d  .Z......\n00000010: beef  ..\n");
  ASSERT_TRUE(bytes);
  EXPECT_EQ(bytes->size(), 18u);
  EXPECT_EQ(bytes->back(), 0xEF);
}

TEST(HexDump, RepeatsTheLinesThatHexdumpLeavesOut) {
  const std::string line = "a5 5a 00 00 00 00 00 00  00 00 00 00 00 00 00 ff";
  const auto bytes = bytes_of_hex_dump("00000000  " + line + "  |.Z|\n*\n00000040  " + line + "  |.Z|\n00000050\n");
  ASSERT_TRUE(bytes);
  EXPECT_EQ(bytes->size(), 80u);
}

TEST(HexDump, KeepsTheDirectionWithMoreBytes) {
  const auto bytes = bytes_of_hex_dump(dump([](std::size_t, const std::string& b) { return "[TX] 3F 0D\n[RX] " + b; }));
  ASSERT_TRUE(bytes);
  EXPECT_EQ(*bytes, truth());
}

TEST(HexDump, IsKnownByTheFirstBytesOfOneLongLine) {
  const Bytes all = truth();
  for (const char* separator : {" ", "", ", "}) {
    const std::string line = hex(truth(), 0, 96, separator);
    for (std::size_t size = 80; size < 90; ++size) {
      const auto bytes = bytes_of_hex_dump(whole_part(std::string_view(line).substr(0, size)));
      ASSERT_TRUE(bytes) << "'" << separator << "', " << size;
      EXPECT_EQ(*bytes, Bytes(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(bytes->size())));
    }
  }
  EXPECT_EQ(whole_part("A5 5A\nA5 5"), "A5 5A\n");
}

TEST(HexDump, LeavesOtherTextsAlone) {
  EXPECT_FALSE(bytes_of_hex_dump("10 20 30\n11 21 31\n12 22 32\n13 23 33\n14 24 34\n15 25 35\n"));
  EXPECT_FALSE(bytes_of_hex_dump("$GYRO,1.25,20.0*5A\r\n$GYRO,1.26,20.0*5B\r\n$GYRO,1.25,20.0*5A\r\n"));
  EXPECT_FALSE(bytes_of_hex_dump("A55A0102\nA55A0203\nA55A0304\nA55A0405\nA55A0405\n"));
  EXPECT_FALSE(bytes_of_hex_dump(""));
}

}  // namespace
}  // namespace prism::drivers
