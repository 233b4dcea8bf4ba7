// SPDX-License-Identifier: MIT
// The live screen, line by line: true from the first line on, whatever became of the gyro or of prismd.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/outside_text.hpp"
#include "tests/support/hostile_texts.hpp"
#include "tools/prismctl/watch.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

json status_of(const char* state, const char* quality, double age_s, int warm_s = 100) {
  const json axis = {{"quality", quality},
                     {"window_s", 100},
                     {"warm_s", warm_s},
                     {"full_s", 110},
                     {"window", {{"rate_deg_per_h", 8.4}, {"mean_rate_deg_per_h", 8.4}}}};
  return {{"name", "gyro1"},    {"state", state},    {"detail", ""},          {"age_s", age_s},
          {"device", "/dev/g"}, {"frames", "trplg"}, {"axes", {{"z", axis}}}, {"line", {{"frames", 1234}}}};
}

json row_at(double time_s, double rate, json corrected = nullptr) {
  return {{"axis", "z"},
          {"time_s", time_s},
          {"rate_deg_per_h", rate},
          {"mean_rate_deg_per_h", rate},
          {"corrected_mean_deg_per_h", corrected}};
}

std::size_t columns_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

class LiveScreen : public testing::Test {
 protected:
  std::vector<std::string> shown(double steady_s, const Size& size = {}) {
    std::vector<std::string> texts;
    for (const Line& line : screen_.lines(size, steady_s, "04:00:00 UTC")) texts.push_back(line.text);
    return texts;
  }
  std::string all(double steady_s, const Size& size = {}) {
    std::string text;
    for (const std::string& line : shown(steady_s, size)) text += line + "\n";
    return text;
  }
  Screen screen_{"socket"};
};

TEST_F(LiveScreen, FitsEveryTerminal) {
  json status = status_of("receiving", "warming+no_model", 0.1, 20);
  for (const char* axis : {"x", "y", "an_axis_with_name"}) status["axes"][axis] = status["axes"]["z"];
  for (const bool several : {false, true}) {
    screen_.status(several ? status : status_of("receiving", "good", 0.1), 0);
    for (int second = 0; second < 300; ++second) screen_.row(row_at(second, 8.4));
    screen_.event({{"time_s", 3}, {"severity", "warning"}, {"text", std::string(300, 'x') + "\n\033[31m"}});
    for (const Size size : {Size{80, 24}, Size{200, 50}, Size{20, 5}, Size{1, 1}, Size{40, 12}, Size{500, 200}}) {
      const auto lines = shown(300, size);
      EXPECT_EQ(lines.size(), static_cast<std::size_t>(size.rows));
      for (const std::string& line : lines) {
        EXPECT_LE(columns_of(line), static_cast<std::size_t>(size.columns)) << line;
        EXPECT_THAT(line, Not(HasSubstr("\033")));
      }
    }
  }
}

TEST_F(LiveScreen, StateAgeAndQualityAreOnTop) {
  screen_.status(status_of("receiving", "warming", 0.2, 16), 0);
  EXPECT_EQ(shown(0)[0], "gyro1  receiving, last data 0.2 s ago                               04:00:00 UTC");
  EXPECT_EQ(shown(0)[1], "/dev/g, frames trplg");
  EXPECT_EQ(shown(0)[2], "quality      warming (16 of 110 s), last data 0.2 s ago");
  EXPECT_EQ(screen_.lines({}, 0, "")[0].colour, Colour::kGood);
  EXPECT_EQ(screen_.lines({}, 0, "")[2].colour, Colour::kWarning);
}

TEST_F(LiveScreen, AllAxesAreOnTheSmallestScreen) {
  json status = status_of("receiving", "good", 0);
  for (const char* axis : {"w", "x", "y"}) status["axes"][axis] = status["axes"]["z"];
  status["axes"]["y"]["quality"] = "rate_invalid";
  screen_.status(status, 0);
  for (const char* axis : {"w", "x", "y", "z"}) {
    json row = row_at(100, 8.4, axis[0] - 'w' + 0.5);
    row["axis"] = axis;
    screen_.row(row);
  }
  const std::string text = all(0);
  for (const char* part :
       {"axis w ", "axis z ", "w           0.50001 │", "corrected   0.49999 │", "z           3.50001 │"})
    EXPECT_THAT(text, HasSubstr(part));
  EXPECT_EQ(screen_.lines({}, 0, "")[7].colour, Colour::kBad);
}

// After the daemon's end the screen went on to say receiving and good.
TEST_F(LiveScreen, ADeadDaemonIsTheTopLine) {
  screen_.status(status_of("receiving", "good", 0), 0);
  screen_.row(row_at(100, 8.4, 0.5));
  screen_.gone("/run/prismd/gyro1.sock: no prismd answers: Connection refused");
  const auto lines = shown(12);
  EXPECT_THAT(lines[0], HasSubstr("gyro1  prismd stopped, last data 12 s ago"));
  EXPECT_THAT(lines[1], HasSubstr("Connection refused; retrying"));
  EXPECT_THAT(lines[2], HasSubstr("no_data (no current measurement), last data 12 s ago"));
  EXPECT_THAT(all(12), Not(HasSubstr("receiving")));
  EXPECT_THAT(all(12), Not(HasSubstr("quality      good")));
  EXPECT_THAT(all(12), Not(HasSubstr("8.4")));
  screen_.status(status_of("receiving", "good", 0), 13);
  EXPECT_THAT(shown(13)[0], HasSubstr("receiving"));
}

TEST_F(LiveScreen, ADaemonThatHangsIsNotBelieved) {
  screen_.status(status_of("receiving", "good", 0), 0);
  EXPECT_THAT(shown(2.9)[2], HasSubstr("good"));
  EXPECT_THAT(all(2.9), HasSubstr("8.4"));
  EXPECT_THAT(shown(3.1)[0], HasSubstr("prismd does not respond, last data 3.1 s ago"));
  EXPECT_THAT(shown(3.1)[2], HasSubstr("no_data"));
  EXPECT_THAT(all(3.1), Not(HasSubstr("8.4")));
}

TEST_F(LiveScreen, AGyroThatIsGoneHasNoNumber) {
  json status = status_of("connecting", "no_data", 15);
  status["detail"] = "unplugged (end of file)";
  screen_.status(status, 15);
  const auto lines = shown(15);
  EXPECT_THAT(lines[0], HasSubstr("connecting, last data 15 s ago"));
  EXPECT_THAT(lines[1], HasSubstr("unplugged (end of file)"));
  EXPECT_THAT(all(15), Not(HasSubstr("8.4")));
}

TEST_F(LiveScreen, TimeGoesOnWhereNoRowComes) {
  screen_.status(status_of("receiving", "good", 0), 0);
  screen_.key('1');
  screen_.row(row_at(100, 8.5, 0.5));
  EXPECT_THAT(all(59), HasSubstr("corrected   0.49999 │"));
  EXPECT_THAT(all(61), Not(HasSubstr("0.49999 │")));
}

TEST_F(LiveScreen, HistoryIsAsOldAsTheData) {
  screen_.status(status_of("connecting", "no_data", 50), 0);
  for (const double time_s : {99, 100}) screen_.row(row_at(time_s, 8.5, 0.5));
  screen_.key('1');
  EXPECT_THAT(all(9), HasSubstr("corrected   0.49999 │"));
  EXPECT_THAT(all(11), Not(HasSubstr("0.49999 │")));
}

TEST_F(LiveScreen, KeysChooseTheTimeSpan) {
  screen_.status(status_of("receiving", "good", 0), 399);
  for (int second = 0; second < 400; ++second) screen_.row(row_at(second, 8, 1 + 0.001 * second));
  EXPECT_THAT(all(399), HasSubstr("span: 10 min"));
  screen_.key('1');
  EXPECT_THAT(all(399), HasSubstr("span: 1 min"));
  EXPECT_THAT(all(399),
              HasSubstr("100 s mean, deg/h    -1 min                        -30 s                     now\n"));
  EXPECT_THAT(all(399), HasSubstr("corrected   1.33900 │"));  // 60 s ago
  EXPECT_THAT(all(399), HasSubstr("z           1.39900 │"));
  for (const char other : {'x', '?', '9'}) screen_.key(other);
  EXPECT_THAT(all(399), HasSubstr("span: 1 min"));
}

std::vector<std::string> drawn(const Trace& trace, double end_s, double span_s, int columns) {
  return trace.lines("x", end_s, span_s, 21 + columns, 2);
}

// The first second's mean is one of few pulses: 8.0 where 8.471 is measured.
TEST(Trace, TheWarmUpDoesNotSquashTheScale) {
  Trace trace;
  for (int second = 0; second < 300; ++second) {
    json row = row_at(second, second < 100 ? 8.0 : 8.47 + 1e-5 * second);
    row["quality"] = second < 100 ? "warming+no_model" : "no_model";
    trace.push(row);
  }
  const auto lines = drawn(trace, 299, 600, 20);
  EXPECT_THAT(lines[0], HasSubstr("x           8.47299 │"));
  EXPECT_THAT(lines[1], HasSubstr("raw rate    8.47100 │"));
}

TEST(Trace, AnEarlierTimeReplacesWhatWasThere) {
  Trace trace;
  for (const double time_s : {1.0, 2.0, 3.0, 2.0}) trace.push(row_at(time_s, time_s));
  EXPECT_THAT(drawn(trace, 3, 3, 20)[0], HasSubstr(" 2.00000 │"));
}

TEST(Trace, DrawsAStepWhereItIs) {
  Trace trace;
  for (int i = 0; i < 80; ++i) trace.push(row_at(i + 0.5, 0, i < 40 ? 1.0 : 2.0));
  EXPECT_EQ(drawn(trace, 80, 80, 4),
            (std::vector<std::string>{"x           2.00000 │⠀⠀⠉⠉", "corrected   1.00000 │⣀⣀⠀⠀"}));
}

TEST(Trace, JoinsNeighboursAndLeavesGaps) {
  Trace trace;
  for (const double time_s : {0.5, 1.5, 2.5, 12.5, 13.5}) trace.push(row_at(time_s, 1));
  EXPECT_EQ(drawn(trace, 16, 16, 16)[1], "raw rate    0.99999 │⠉⠉⠉⠉⠀⠀⠀⠀⠀⠀⠀⠈⠉⠉⠉⠀");
  EXPECT_EQ(drawn(Trace(), 16, 16, 2),
            (std::vector<std::string>{"x                   │⠀⠀", "raw rate            │⠀⠀"}));
}

TEST_F(LiveScreen, NoTextReachesTheTerminalAsASequence) {
  for (const std::string& text : test::hostile_texts()) {
    SCOPED_TRACE(text.substr(0, 40));
    json status = status_of(text.c_str(), text.c_str(), 0.1);
    for (const char* key : {"name", "detail", "device", "frames"}) status[key] = text;
    status["axes"]["z"]["model"] = {{"name", text}};
    for (const bool several : {false, true}) {
      Screen screen(text);
      if (several) status["axes"][text] = status["axes"]["z"];
      screen.status(status, 0);
      screen.row({{"axis", text}, {"time_s", 1}});
      screen.event({{"time_s", 1}, {"severity", text}, {"text", text}});
      for (const char* gone : {"", text.c_str()}) {
        if (*gone != '\0') screen.gone(gone);
        for (const Line& line : screen.lines({}, 0.1, "12:00:00 UTC")) {
          EXPECT_TRUE(is_printable(line.text)) << line.text;
          EXPECT_LE(columns_of(line.text), 80U);
        }
      }
    }
  }
}

TEST_F(LiveScreen, AnyTypeIsShown) {
  const std::vector<json> others = {nullptr, true, -1, 1e300, "text", json::array({1, "a"}), {{"a", {{"b", 1}}}}};
  for (const json& other : others) {
    Screen screen("g");
    json status = status_of("receiving", "good", 0.1), axis = status;
    for (auto& [key, value] : status.items()) value = other;
    axis["axes"]["z"] = other;
    EXPECT_NO_THROW({
      for (const json& one : {status_of("receiving", "good", 0.1), axis, status, other}) {
        screen.status(one, 0);
        screen.row(other);
        for (const json& name : {other, json("z")}) screen.row({{"axis", name}, {"time_s", other}});
        screen.event(other);
        screen.event({{"time_s", other}, {"text", other}});
        (void)screen.lines({}, 0.1, "12:00:00 UTC");
        (void)screen.lines({}, 5, "12:00:00 UTC");
      }
    }) << other;
  }
}

}  // namespace
}  // namespace prism::prismctl
