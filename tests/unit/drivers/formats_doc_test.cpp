// SPDX-License-Identifier: MIT
// docs/formats.md shows a capture in hex: exactly the bytes of the writer.
#include <gtest/gtest.h>

#include <array>
#include <sstream>

#include "drivers/capture_file.hpp"
#include "tests/support/document.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::drivers {
namespace {

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
