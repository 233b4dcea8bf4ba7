// SPDX-License-Identifier: MIT
// Events: a fault is shown once; its repeats are counted.
#include "daemon/socket/event_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace prism::socket {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;

struct EventLogTest : testing::Test {
  void add(const std::string& text, std::int64_t time_ns = 0) {
    log.add(Severity::kWarning, "disk", text, time_ns, now);
  }
  std::vector<std::string> told;
  EventLog log{[this](const Event& event) { told.push_back(event.text); }};
  EventLog::Clock::time_point now{seconds(1000)};
};

TEST_F(EventLogTest, TheSameIsToldOnceInTenSecondsAndThenWithItsCount) {
  for (int i = 0; i < 10; ++i, now += seconds(1)) add("full");
  EXPECT_THAT(told, ElementsAre("full"));
  add("full");
  EXPECT_THAT(told, ElementsAre("full", "full"));
  EXPECT_EQ(log.recent().back().repeats, 9u);
  now += EventLog::kQuiet;
  add("full");
  EXPECT_EQ(log.recent().back().repeats, 0u);
}

// Earlier bug: a line that came back within ten seconds of its last "receiving" was never reported as back.
TEST_F(EventLogTest, TheLastEventToldOfALineIsTheLastThatHappened) {
  const auto line = [this](const char* kind, std::int64_t time_ns) {
    log.add(Severity::kInfo, kind, kind, time_ns, now += seconds(1));
  };
  line("line_receiving", 1);
  line("line_lost", 2);
  line("line_receiving", 3);
  line("line_lost", 4);
  line("line_receiving", 5);
  add("full");  // of another subject
  log.tell_late(now);
  EXPECT_THAT(told, ElementsAre("line_receiving", "line_lost", "full"));
  log.tell_late(now += EventLog::kQuiet);
  EXPECT_THAT(told, ElementsAre("line_receiving", "line_lost", "full", "line_lost", "line_receiving"));
  EXPECT_EQ(log.recent().back().time_ns, 5);
  EXPECT_EQ(log.recent().back().repeats, 1u) << "the one of time 3";
  log.tell_late(now += EventLog::kQuiet);
  EXPECT_EQ(told.size(), 5u) << "nothing happened since";
}

TEST_F(EventLogTest, ASuppressedEventIsToldBeforeTheNextOfItsLine) {
  for (const char* kind : {"line_receiving", "line_lost", "line_receiving", "line_silent"})
    log.add(Severity::kInfo, kind, kind, 0, now += seconds(1));
  EXPECT_THAT(told, ElementsAre("line_receiving", "line_lost", "line_receiving", "line_silent"));
}

TEST_F(EventLogTest, AnotherTextOrKindIsToldAtOnce) {
  add("full");
  add("gone");
  log.add(Severity::kWarning, "line", "full", 0, now);
  EXPECT_THAT(told, ElementsAre("full", "gone", "full"));
}

// Earlier bug: after the host clock was set back by an hour, a repeated fault was not shown for an hour.
TEST_F(EventLogTest, AHostClockThatIsSetBackSilencesNothing) {
  constexpr std::int64_t kHour = 3'600'000'000'000;
  add("full", 2 * kHour);
  now += EventLog::kQuiet;
  add("full", kHour);
  EXPECT_THAT(told, ElementsAre("full", "full"));
  EXPECT_EQ(log.recent().back().time_ns, kHour);
}

TEST_F(EventLogTest, KeepsTheLastOnes) {
  for (std::size_t i = 0; i < EventLog::kKept + 10; ++i) add(std::to_string(i));
  ASSERT_EQ(log.recent().size(), EventLog::kKept);
  EXPECT_EQ(log.recent().front().text, "10");
  EXPECT_EQ(log.recent().back().text, std::to_string(EventLog::kKept + 9));
}

TEST_F(EventLogTest, ByTheClockThatRunsUnlessATestGivesAnother) {
  log.add(Severity::kInfo, "a", "now", 0);
  log.add(Severity::kInfo, "a", "now", 0);
  EXPECT_THAT(told, ElementsAre("now"));
}

TEST_F(EventLogTest, WritesAnEventAsJsonWhenItHappens) {
  log.add(Severity::kError, "disk", "a \"b\"\n", 1'700'000'000'123'999'999, now);
  const std::string text = R"({"time_s":1700000000.123,"severity":"error","kind":"disk","text":"a \"b\"\n")";
  EXPECT_EQ(log.recent().back().json, text + "}");
  for (int i = 0; i < 7; ++i) log.add(Severity::kError, "disk", "a \"b\"\n", 0, now);
  log.add(Severity::kError, "disk", "a \"b\"\n", 1'700'000'000'123'999'999, now + EventLog::kQuiet);
  EXPECT_EQ(log.recent().back().json, text + R"(,"repeats":7})");
}

TEST_F(EventLogTest, WritesUtf8WhateverTheTextHolds) {
  log.add(Severity::kInfo, "k", "\xff", 0, now);
  EXPECT_EQ(log.recent().back().json,
            "{\"time_s\":0.0,\"severity\":\"info\",\"kind\":\"k\",\"text\":\"\xef\xbf\xbd\"}");
}

}  // namespace
}  // namespace prism::socket
