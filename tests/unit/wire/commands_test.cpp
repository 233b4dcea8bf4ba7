// SPDX-License-Identifier: MIT
// Start-up commands and polls: read from JSON, and run without a clock of their own.
#include "drivers/wire/description/commands.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_table.hpp"
#include "drivers/commands.hpp"
#include "tests/support/blocks.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::drivers {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using At = StartUp::Time;

At after(int ms) { return At() + milliseconds(ms); }

std::string text_of(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

struct Read {
  wire::Commands commands;
  std::string error;
};

Read read(const std::string& json) {
  const auto document = parse_json_object(json, "x.json");
  EXPECT_TRUE(document);
  const Section section(*document);
  Read result;
  wire::command_keys().read(section, result.commands);
  if (const auto rest = section.finish(); !rest) result.error = rest.error().text();
  return result;
}

StartUp start_up(const std::string& steps) { return StartUp(*read("{\"start\": " + steps + "}").commands.start); }

TEST(Commands, AreReadFromJson) {
  const Read got = read(R"({
    "start": [{"send": "SERVICEMODE\r", "expect": "OK", "within_ms": 500}, {"wait_ms": 200}, {"send_hex": "55 AA 01 FE"}],
    "stop": [{"send": "x"}], "again_when_silent": true,
    "poll": {"every_ms": 500, "within_ms": 100, "pause_ms": 5, "requests": [{"send": "A"}, {"send": "B", "within_ms": 50}]}})");
  EXPECT_EQ(got.error, "");
  ASSERT_EQ(got.commands.start->size(), 3u);
  EXPECT_EQ((*got.commands.start)[0].within, milliseconds(500));
  EXPECT_EQ((*got.commands.start)[1].wait, milliseconds(200));
  EXPECT_THAT((*got.commands.start)[2].send, testing::ElementsAre(0x55, 0xAA, 0x01, 0xFE));
  EXPECT_EQ(got.commands.stop->size(), 1u);
  EXPECT_TRUE(*got.commands.again_when_silent);
  ASSERT_EQ(got.commands.poll->requests.size(), 2u);
  EXPECT_EQ(got.commands.poll->requests[0].within, milliseconds(100));
  EXPECT_EQ(got.commands.poll->requests[1].within, milliseconds(50));
}

TEST(Commands, MistakesAreReported) {
  for (const test::Block& row : test::blocks("wire/command_errors.txt", 2))
    EXPECT_THAT(read(row[0]).error, testing::StartsWith(row[1])) << row.where;
}

TEST(Commands, OfAConfigurationReplaceThoseOfTheDescription) {
  const wire::Commands described = read(R"({"start": [{"send": "A"}], "poll": {"send": "P"}})").commands;
  const wire::Commands used = described.with(read(R"({"start": [], "stop": [{"send": "Z"}]})").commands);
  EXPECT_TRUE(used.start->empty());
  EXPECT_EQ(used.stop->size(), 1u);
  EXPECT_EQ(used.poll, described.poll);
}

TEST(Commands, DoNotChangeTheIdOfADescription) {
  const std::string path = (test::frames_dir() / "trplg.json").string();
  const std::string text = test::read_file(path);
  const auto plain = wire::parse_frame_description(text, path);
  const std::string with = std::string(text).replace(text.find("\"format\""), 0, R"("start": [{"send": "A"}], )");
  const auto commanded = wire::parse_frame_description(with, path);
  ASSERT_TRUE(plain && commanded);
  EXPECT_EQ((*plain)->id, (*commanded)->id);
  EXPECT_EQ((*commanded)->commands.start->size(), 1u);
}

TEST(StartUp, SendsTheStepsInTheirOrder) {
  StartUp run = start_up(R"([{"send": "one\r", "expect": "OK"}, {"wait_ms": 200}, {"send": "two"}])");
  EXPECT_EQ(text_of(run.proceed(after(0))), "one\r");
  EXPECT_EQ(text_of(run.proceed(after(0))), "");
  EXPECT_EQ(run.text(), "step 1 of 3");
  EXPECT_EQ(run.deadline(), after(1000));
  run.received(bytes_of("noise O"));
  EXPECT_EQ(text_of(run.proceed(after(10))), "");
  run.received(bytes_of("K\r\n"));
  EXPECT_EQ(text_of(run.proceed(after(20))), "");
  EXPECT_EQ(run.text(), "step 2 of 3");
  EXPECT_EQ(text_of(run.proceed(after(219))), "");
  EXPECT_EQ(text_of(run.proceed(after(220))), "two");
  EXPECT_EQ(text_of(run.proceed(after(220))), "");
  EXPECT_TRUE(run.is_done());
  EXPECT_FALSE(run.has_failed());
}

TEST(StartUp, ReportsWhatItReceivedInsteadOfTheAnswer) {
  StartUp run = start_up(R"([{"wait_ms": 0}, {"send": "A", "expect": "OK\r"}, {"send": "B"}])");
  EXPECT_EQ(text_of(run.proceed(after(0))), "A");
  run.proceed(after(0));
  run.received(bytes_of("ERR"));
  run.proceed(after(999));
  EXPECT_FALSE(run.has_failed());
  EXPECT_EQ(text_of(run.proceed(after(1000))), "");
  EXPECT_TRUE(run.has_failed());
  EXPECT_EQ(run.text(), "step 2 of 3: expected OK, received 45 52 52");
  StartUp mute = start_up(R"([{"send": "A", "expect_hex": "FA 31"}])");
  mute.proceed(after(0));
  mute.proceed(after(1000));
  EXPECT_EQ(mute.text(), "step 1 of 1: expected FA 31, received nothing");
  StartUp flooded = start_up(R"([{"send": "A", "expect": "OK"}])");
  flooded.proceed(after(0));
  flooded.received(bytes_of(std::string(1000, '.')));
  flooded.proceed(after(1000));
  EXPECT_THAT(flooded.text(), HasSubstr("received 1000 bytes, the last 2E 2E"));
}

TEST(StartUp, AnAnswerBeforeItsCommandDoesNotCount) {
  StartUp run = start_up(R"([{"send": "A", "expect": "OK"}, {"send": "B", "expect": "OK"}])");
  run.proceed(after(0));
  run.received(bytes_of("OKOK"));
  EXPECT_EQ(text_of(run.proceed(after(1))), "B");
  run.proceed(after(1002));
  EXPECT_TRUE(run.has_failed());
}

// Answers of random bytes never end the program; the start-up ends in its time.
TEST(StartUp, TenThousandDamagedAnswers) {
  std::mt19937 random(43);
  for (int i = 0; i < 10'000; ++i) {
    StartUp run =
        start_up(R"([{"send": "A", "expect": "OK\r\n"}, {"send_hex": "00 FF", "expect_hex": "00"}, {"wait_ms": 5}])");
    int ms = 0;
    for (; ms < 3000 && !run.is_done() && !run.has_failed(); ms += 100) {
      while (!run.proceed(after(ms)).empty()) continue;
      std::string answer = i % 2 ? "OK\r\n" : "";
      for (auto n = random() % 40; n-- > 0;)
        answer.insert(answer.begin() + static_cast<long>(random() % (answer.size() + 1)), static_cast<char>(random()));
      run.received(bytes_of(answer));
    }
    EXPECT_LT(ms, 3000);
    EXPECT_LT(run.text().size(), 200u);
  }
}

Poller poller(const std::string& poll) { return Poller(*read("{\"poll\": " + poll + "}").commands.poll); }

TEST(Poller, PeriodsDoNotDrift) {
  Poller poll = poller(R"({"every_ms": 1000, "send": "READ?", "within_ms": 300, "pause_ms": 20})");
  std::mt19937 random(1);
  At now = after(0);
  poll.begin(now);
  int asked = 0;
  while (now < after(86'400'000)) {
    if (!poll.proceed(now).empty()) {
      ++asked;
      EXPECT_LT(now - after(1000 * (asked - 1)), milliseconds(20)) << "a late call does not move the later ones";
      now += milliseconds(random() % 250);
      poll.replied(now);
    }
    now = std::max(now, poll.deadline()) + milliseconds(random() % 3);
  }
  EXPECT_EQ(asked, 86'400);
  EXPECT_EQ(poll.counters().requests, 86'400u);
  EXPECT_EQ(poll.counters().missed, 0u);
  EXPECT_EQ(poll.counters().skipped, 0u);
}

TEST(Poller, AsksInTurnAndCountsMissedReplies) {
  Poller poll =
      poller(R"({"every_ms": 1000, "within_ms": 300, "pause_ms": 20, "requests": [{"send": "A"}, {"send": "B"}]})");
  poll.begin(after(0));
  EXPECT_EQ(text_of(poll.proceed(after(0))), "A");
  EXPECT_EQ(text_of(poll.proceed(after(50))), "");
  poll.replied(after(50));
  EXPECT_EQ(poll.deadline(), after(70));
  EXPECT_EQ(text_of(poll.proceed(after(60))), "") << "the pause on a shared line";
  EXPECT_EQ(text_of(poll.proceed(after(70))), "B");
  EXPECT_EQ(text_of(poll.proceed(after(370))), "") << "no reply";
  EXPECT_EQ(poll.counters().missed, 1u);
  EXPECT_EQ(poll.deadline(), after(1000));
  poll.replied(after(400));  // too late
  EXPECT_EQ(poll.deadline(), after(1000));
  EXPECT_EQ(text_of(poll.proceed(after(1000))), "A");
}

// Version 0.3 asked an instrument that closes its connection after each reply ten times a second instead of once a
// minute.
TEST(Poller, KeepsItsPeriodsWhenTheLineIsOpenedAgain) {
  Poller poll =
      poller(R"({"every_ms": 60000, "within_ms": 300, "pause_ms": 20, "requests": [{"send": "A"}, {"send": "B"}]})");
  poll.begin(after(0));
  EXPECT_EQ(text_of(poll.proceed(after(0))), "A");
  poll.replied(after(10));
  EXPECT_EQ(text_of(poll.proceed(after(30))), "B");
  poll.replied(after(40));
  poll.begin(after(140));  // opened again
  EXPECT_EQ(poll.deadline(), after(60'000));
  EXPECT_EQ(text_of(poll.proceed(after(60'000))), "A");
  poll.begin(after(60'100));  // lost without a reply
  EXPECT_EQ(poll.deadline(), after(120'000));
  EXPECT_EQ(text_of(poll.proceed(after(120'000))), "A") << "a round begins with its first request";
  EXPECT_EQ(poll.counters().requests, 4u);
  EXPECT_EQ(poll.counters().missed, 1u);
  poll.begin(after(500'000));  // after a long absence
  EXPECT_EQ(poll.deadline(), after(500'000));
}

TEST(Poller, SkipsPeriodsThatARoundCovers) {
  Poller poll = poller(R"({"every_ms": 100, "send": "A", "within_ms": 350, "pause_ms": 0})");
  poll.begin(after(0));
  poll.proceed(after(0));
  EXPECT_EQ(text_of(poll.proceed(after(350))), "A") << "the round of 300 ms, late";
  EXPECT_EQ(poll.counters().skipped, 2u);
  poll.replied(after(351));
  EXPECT_EQ(poll.deadline(), after(400));
}

}  // namespace
}  // namespace prism::drivers
