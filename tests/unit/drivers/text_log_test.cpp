// SPDX-License-Identifier: MIT
// Logs of sentences are read as the bytes of the device.
#include "drivers/text_log.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

namespace prism::drivers {
namespace {

std::string sentence(int i) {
  const std::string body = fmt::format("HEHDT,{}.00,T", i);
  unsigned sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  return fmt::format("${}*{:02X}", body, sum);
}

/// Twenty lines, each made by `line` of its sentence.
template <class MakeLine>
std::string log_of(MakeLine line) {
  std::string text;
  for (int i = 0; i < 20; ++i) text += line(i, sentence(i));
  return text;
}

std::string text_of(const std::string& log) {
  const auto bytes = bytes_of_text_log(log);
  return bytes ? std::string(bytes->begin(), bytes->end()) : "no log";
}

const std::string kSent = log_of([](int, const std::string& s) { return s + "\r\n"; });

TEST(TextLog, RemovesStampsAndRestoresLineEnds) {
  EXPECT_EQ(text_of(log_of([](int, const std::string& s) { return s + "\n"; })), kSent);
  EXPECT_EQ(text_of(log_of([](int i, const std::string& s) { return fmt::format("[12:00:{:02}.5] {}\r\n", i, s); })),
            kSent);
  EXPECT_EQ(text_of(log_of([](int i, const std::string& s) { return fmt::format("17957808{:02}.25,{}\n", i, s); })),
            kSent);
  EXPECT_EQ(text_of("# log of COM3!\n" + log_of([](int, const std::string& s) { return "RX: " + s + "\n\n"; })), kSent);
}

TEST(TextLog, LeavesOutDamagedAndIncompleteLines) {
  const std::string stamped = log_of([](int i, const std::string& s) {
    return fmt::format("{:02} {}\n", i, i == 7 ? s.substr(0, 8) + "9" + s.substr(9) : s);
  });
  const std::string lost = sentence(7) + "\r\n";
  std::string expected = kSent;
  expected.erase(expected.find(lost), lost.size());
  EXPECT_EQ(text_of(stamped + "20 $HEHD"), expected);
}

TEST(TextLog, LeavesOtherTextsAlone) {
  EXPECT_EQ(text_of(kSent), "no log") << "what the device sends";
  EXPECT_EQ(text_of("t,rate\n0,1.5\n1,1.6\n2,1.5\n3,1.7\n4,1.6\n5,1.5\n6,1.4\n"), "no log");
  EXPECT_EQ(text_of("12:00 $HEHDT,1,T*00\n12:01 $HEHDT,2,T*00\n12:02 $HEHDT,3,T*00\n"), "no log") << "wrong checksums";
  EXPECT_EQ(text_of(""), "no log");
  EXPECT_TRUE(is_text_log(kSent));
  EXPECT_FALSE(is_text_log("t,rate\n0,1.5\n1,1.6\n2,1.5\n"));
}

}  // namespace
}  // namespace prism::drivers
