// SPDX-License-Identifier: MIT
// Every description in config/frames loads, and decodes the test vectors it carries.
#include <gtest/gtest.h>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

TEST(ShippedDescriptions, LoadAndDecodeTheirOwnTestVectors) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::frames_dir())) {
    if (entry.path().extension() != ".json" || entry.path().filename() == "frame.schema.json") continue;
    const auto parsed = parse_frame_description(test::read_file(entry.path()), entry.path().filename().string());
    ASSERT_TRUE(parsed) << parsed.error().text();
    EXPECT_EQ((*parsed)->name, entry.path().stem()) << "the file is named after the description";
    EXPECT_FALSE((*parsed)->source.empty()) << entry.path();
    EXPECT_FALSE((*parsed)->test_vectors.empty()) << entry.path();
    const auto vectors = run_test_vectors(**parsed);
    EXPECT_TRUE(vectors) << vectors.error().text();
    ++count;
  }
  EXPECT_GE(count, 24);
}

TEST(ShippedDescriptions, ReportAWrongValueOfAVector) {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  const std::size_t at = text.find("\"counter\": 4660");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 15, "\"counter\": 4661");
  const auto result = run_test_vectors(*test::description_of(text));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().text(), "test.json:/vectors/0: counter is 4660; expected 4661");
}

TEST(ShippedDescriptions, RequireOneCompleteFramePerVector) {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  const std::size_t at = text.find("00 07 63 4D");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 11, "00 07 63 4D A5");
  const auto result = run_test_vectors(*test::description_of(text));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().text(),
            "test.json:/vectors/0: 20 of 21 bytes are a frame; expected one frame of message type data");
}

}  // namespace
}  // namespace prism::wire
