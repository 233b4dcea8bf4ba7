// SPDX-License-Identifier: MIT
// Start-up commands and polls: read from JSON, and run without a clock of their own.
#include "drivers/wire/description/commands.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_table.hpp"
#include "drivers/commands.hpp"
#include "tests/support/blocks.hpp"
#include "tests/support/scripts.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::drivers {
namespace {

using std::chrono::milliseconds;
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

Poller poller(const std::string& poll) { return Poller(*read("{\"poll\": " + poll + "}").commands.poll); }

/// A time in ms gives the bytes that are sent then; `< TEXT` are received, `MS begin` opens the line, `MS replied`.
class ConversationPlayer {
 public:
  std::vector<std::string> play(const std::string& command, std::istream& words) {
    if (command == "start") {
      start_.emplace(start_up(test::rest_of(words)));
    } else if (command == "poll") {
      poll_.emplace(poller(test::rest_of(words)));
    } else if (command == "<") {
      start_->received(bytes_of(test::rest_of(words)));
    } else if (command == "state") {
      return {state()};
    } else {
      const At now = after(std::stoi(command));
      const auto what = test::next<std::string>(words);
      if (what == "begin") poll_->begin(now);
      if (what == "replied") poll_->replied(now);
      if (!what.empty()) return {};
      const std::string sent = text_of(start_ ? start_->proceed(now) : poll_->proceed(now));
      if (!sent.empty()) return {"> " + bytes_text(bytes_of(sent))};
    }
    return {};
  }

 private:
  std::string state() const {
    const auto at = (start_ ? start_->deadline() : poll_->deadline()) - after(0);
    if (start_)
      return fmt::format("{}{}{}, until {}", start_->text(), start_->is_done() ? ", done" : "",
                         start_->has_failed() ? ", failed" : "", at / milliseconds(1));
    const PollCounters& counters = poll_->counters();
    return fmt::format("{} requests, {} missed, {} skipped, next at {}", counters.requests, counters.missed,
                       counters.skipped, at / milliseconds(1));
  }

  std::optional<StartUp> start_;
  std::optional<Poller> poll_;
};

TEST(Conversation, Scripts) { test::expect_scripts<ConversationPlayer>("wire/conversations.txt"); }

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

}  // namespace
}  // namespace prism::drivers
