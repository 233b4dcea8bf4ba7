// SPDX-License-Identifier: MIT
// Texts that show bytes are refused with the command that writes the bytes; tables and what a device sends are not.
#include "drivers/shown_bytes.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "base/file.hpp"

namespace prism::drivers {
namespace {

const std::string kFiles = PRISM_SOURCE_DIR "/tests/files/";

std::string kind_of(std::string_view text) {
  const auto found = has_sentences("it's.txt", text.substr(0, kFirstBytes));
  if (!found) return found.error().text();
  return *found ? "sentences" : "";
}

std::string refused(const char* what) {
  return fmt::format(
      "it's.txt: found a {}, expected the bytes of the line; prism-import 'it'\\''s.txt' --hex --out line.bin writes "
      "them",
      what);
}

TEST(ShownBytes, OfEachProgramAreRefused) {
  for (const char* name : {"xxd.txt", "hexdump.txt", "socat.txt", "terminal.log", "plain-hex.txt"})
    EXPECT_EQ(kind_of(*read_text_file(kFiles + "import/" + name, 1 << 20)), refused("hex dump")) << name;
  EXPECT_EQ(kind_of(*read_text_file(kFiles + "import/sentences.log", 1 << 20)), refused("log of sentences"));
}

TEST(ShownBytes, BehindAnOffsetOf6To16DigitsAreRefused) {
  const auto dump = [](std::size_t digits) {
    std::string text;
    for (int i = 0; i < 4; ++i) text += fmt::format("{:0{}x}: a55a 0102 0304 {:04x}\n", 8 * i, digits, 99 * i);
    return text;
  };
  for (const std::size_t digits : {6, 8, 16}) EXPECT_EQ(kind_of(dump(digits)), refused("hex dump")) << digits;
  for (const std::size_t digits : {5, 17}) EXPECT_EQ(kind_of(dump(digits)), "") << digits;
}

TEST(ShownBytes, OfOneLongLineAreRefused) {
  for (const char* separator : {" ", "", ", 0x"}) {
    std::string line = "A5";
    for (int i = 1; i < 3000; ++i) line += fmt::format("{}{:02X}", separator, (i * 37 + 0xA5) % 256);
    EXPECT_EQ(kind_of(line), refused("hex dump")) << separator;
  }
}

TEST(ShownBytes, AreNotInTables) {
  for (const auto& file : std::filesystem::directory_iterator(kFiles + "data")) {
    const auto text = read_text_file(file.path().string(), 1 << 20);
    EXPECT_EQ(kind_of(text ? *text : ""), "") << file.path();
  }
  EXPECT_EQ(kind_of("10 20 30\n11 21 31\n12 22 32\n13 23 33\n14 24 34\n15 25 35\n"), "");
  EXPECT_EQ(kind_of("A55A0102\nA55A0203\nA55A0304\nA55A0405\nA55A0405\n"), "");
  EXPECT_EQ(kind_of("9.2927 20.01 A5\n9.2930 20.02 5B\n9.2931 20.03 3C\n9.2927 20.04 D8\n"), "");
}

TEST(ShownBytes, AreNotInSentencesOfADevice) {
  EXPECT_EQ(kind_of("$GYRO,1.25,20.0*5A\r\n$GYRO,1.26,20.0*5B\r\n$GYRO,1.25,20.0*5A\r\n"), "sentences");
  EXPECT_EQ(kind_of("$GYRO,1.25,20.0*5A\n$GYRO,1.26,20.0*5B\n$GYRO,1.25,20.0*5A\n"), "sentences");
  EXPECT_EQ(kind_of("$GYRO,1.25,20.0*ZA\n$GYRO,1.26,20.0*ZB\n$GYRO,1.25,20.0*ZA\n"), "");
}

}  // namespace
}  // namespace prism::drivers
