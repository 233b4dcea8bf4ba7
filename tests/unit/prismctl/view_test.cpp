// SPDX-License-Identifier: MIT
// The live screen, line by line: true from the first line on, whatever became of the gyro or of prismd.
#include "tools/prismctl/screen/view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/outside_text.hpp"
#include "tests/support/hostile_texts.hpp"
#include "tools/prismctl/screen/chart.hpp"

namespace prism::screen {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

json status_of(const char* state, const char* quality, double age_s, int warm_s = 100) {
  return {{"name", "gyro1"},           {"state", state},   {"detail", ""},  {"quality", quality}, {"age_s", age_s},
          {"window_s", 100},           {"warm_s", warm_s}, {"full_s", 110}, {"device", "/dev/g"}, {"frames", "trplg"},
          {"line", {{"frames", 1234}}}};
}

json row_at(double time_s, double rate, json corrected = nullptr) {
  return {{"time_s", time_s},
          {"rate_deg_per_h", rate},
          {"mean_rate_deg_per_h", rate},
          {"corrected_mean_deg_per_h", corrected},
          {"bias_deg_per_h", corrected.is_null() ? json() : json(0.1)}};
}

std::string text_of_line(const Line& line) {
  std::string text;
  for (const Piece& piece : line) text += piece.text;
  return text;
}

class LiveScreen : public testing::Test {
 protected:
  std::vector<std::string> shown(double steady_s, const Size& size = {}) {
    std::vector<std::string> texts;
    for (const Line& line : view_.lines(size, steady_s, "04:00:00 UTC")) texts.push_back(text_of_line(line));
    return texts;
  }
  std::string all(double steady_s, const Size& size = {}) {
    std::string text;
    for (const std::string& line : shown(steady_s, size)) text += line + "\n";
    return text;
  }
  View view_{"socket", true};
};

TEST_F(LiveScreen, FitsEveryTerminal) {
  view_.status(status_of("receiving", "warming+no_model", 0.1, 20), 0);
  for (int second = 0; second < 300; ++second) view_.window(row_at(second, 8.4), second);
  view_.event({{"time_s", 3}, {"severity", "warning"}, {"text", std::string(300, 'x') + "\n\033[31m"}});
  for (const Size size : {Size{80, 24}, Size{200, 50}, Size{20, 5}, Size{1, 1}, Size{40, 12}, Size{500, 200}}) {
    for (const char key : {'?', '?'}) {
      const auto lines = view_.lines(size, 300, "04:00:00 UTC");
      EXPECT_EQ(lines.size(), static_cast<std::size_t>(size.rows));
      for (const Line& line : lines) {
        EXPECT_LE(columns_of(line), size.columns) << text_of_line(line);
        EXPECT_THAT(text_of_line(line), Not(HasSubstr("\033")));
      }
      view_.key(key, 300);
    }
  }
}

TEST_F(LiveScreen, StateAgeAndQualityStandOnTop) {
  view_.status(status_of("receiving", "warming", 0.2, 16), 0);
  EXPECT_EQ(shown(0)[0], "gyro1  receiving  last data 0.2 s ago  warming (16 of 110 s)        04:00:00 UTC");
}

// "warming (4 s)" stood under 16 s of chart: the head was of the last event.
TEST_F(LiveScreen, TheHeadIsOfTheLastStatus) {
  view_.status(status_of("receiving", "warming", 0, 4), 0);
  view_.status(status_of("receiving", "warming", 0, 16), 1);
  EXPECT_THAT(all(1), HasSubstr("warming (16 of 110 s)"));
  EXPECT_THAT(all(1), Not(HasSubstr("(4 of")));
}

// After the daemon's end the screen went on to say receiving and good.
TEST_F(LiveScreen, ADeadDaemonIsTheTopLine) {
  view_.status(status_of("receiving", "good", 0), 0);
  view_.window(row_at(100, 8.4, 0.5), 0);
  view_.gone("/run/prismd/gyro1.sock: no prismd answers: Connection refused");
  const auto lines = shown(12);
  EXPECT_THAT(lines[0], HasSubstr("gyro1  prismd stopped  last data 12 s ago  no_data"));
  EXPECT_THAT(lines[1], HasSubstr("Connection refused; retrying"));
  EXPECT_THAT(all(12), Not(HasSubstr("receiving")));
  EXPECT_THAT(all(12), Not(HasSubstr("good")));
  for (int line = 3; line < 6; ++line) EXPECT_THAT(lines[static_cast<std::size_t>(line)], Not(HasSubstr("8.4")));
  view_.status(status_of("receiving", "good", 0), 13);
  EXPECT_THAT(shown(13)[0], HasSubstr("receiving"));
}

TEST_F(LiveScreen, ADaemonThatHangsIsNotBelieved) {
  view_.status(status_of("receiving", "good", 0), 0);
  view_.window(row_at(100, 8.4, 0.5), 0);
  EXPECT_THAT(shown(2.9)[0], HasSubstr("good"));
  EXPECT_THAT(shown(3.1)[0], HasSubstr("prismd does not respond  last data 3.1 s ago  no_data"));
  EXPECT_THAT(shown(3.1)[3], Not(HasSubstr("8.4")));
}

TEST_F(LiveScreen, AGyroThatIsGoneHasNoNumber) {
  view_.window(row_at(100, 8.4, 0.5), 0);
  json status = status_of("connecting", "no_data", 15);
  status["detail"] = "unplugged (end of file)";
  view_.status(status, 15);
  const auto lines = shown(15);
  EXPECT_THAT(lines[0], HasSubstr("connecting  last data 15 s ago  no_data"));
  EXPECT_THAT(lines[1], HasSubstr("unplugged (end of file)"));
  EXPECT_THAT(lines[3], Not(HasSubstr("8.4")));
}

TEST_F(LiveScreen, TimeGoesOnWhereNoRowComes) {
  view_.status(status_of("receiving", "good", 0), 0);
  view_.key('1', 0);
  view_.window(row_at(100, 8.4, 0.5), 0);
  EXPECT_THAT(all(59), HasSubstr("8.4"));
  EXPECT_THAT(all(61), HasSubstr("raw rate, 100 s mean, deg/h: no data in this time span"));
}

TEST_F(LiveScreen, KeysChooseSpanAxisAndPause) {
  view_.status(status_of("receiving", "good", 0), 0);
  for (int second = 0; second < 200; ++second) view_.window(row_at(second, 8 + 0.001 * second, 1), second);
  EXPECT_THAT(all(199), HasSubstr("span: 10 min"));
  view_.key('1', 199);
  EXPECT_THAT(all(199), HasSubstr("span: 1 min"));
  EXPECT_THAT(all(199), HasSubstr("-30 s"));
  EXPECT_THAT(all(199), HasSubstr("8.13900 │"));  // 60 s ago
  EXPECT_THAT(all(199), Not(HasSubstr("0.97000 │")));
  view_.key('a', 199);
  EXPECT_THAT(all(199), HasSubstr("0.97000 │"));  // 1 ± half of the other's span
  view_.key('p', 199);
  view_.window(row_at(200, 9, 1), 200);
  EXPECT_THAT(all(200), HasSubstr("paused"));
  EXPECT_THAT(all(200), HasSubstr("8.19900 │"));
  view_.key('p', 200);
  EXPECT_THAT(all(200), HasSubstr("9.00000 │"));
  view_.key('x', 200);
  view_.key('?', 200);
  EXPECT_THAT(all(200), HasSubstr("this help"));
}

// The first second's mean is one of few pulses: 8.0 where 8.471 is measured.
TEST_F(LiveScreen, TheWarmUpDoesNotSquashTheScale) {
  view_.status(status_of("receiving", "no_model", 0), 0);
  for (int second = 0; second < 300; ++second)
    view_.window(row_at(second, second < 100 ? 8.0 : 8.47 + 1e-5 * second), second);
  EXPECT_THAT(all(299), HasSubstr("8.47100 │"));
  EXPECT_THAT(all(299), HasSubstr("8.47299 │"));
  EXPECT_THAT(all(299), Not(HasSubstr("8.00000 │")));
}

TEST_F(LiveScreen, AnEarlierTimeReplacesWhatStood) {
  Trace trace;
  for (const double time_s : {1.0, 2.0, 3.0, 2.0}) trace.push(row_at(time_s, time_s), 100);
  EXPECT_EQ(trace.points().size(), 2u);
  for (int second = 0; second < 90'000; ++second) trace.push(row_at(second, 1), 100);
  EXPECT_EQ(trace.points().size(), 86'401u);
}

TEST(Chart, DrawsAStepWhereItIs) {
  std::deque<TracePoint> points;
  for (int i = 0; i < 8; ++i) points.push_back({i + 0.5, i < 4 ? 1.0 : 2.0, 0, true});
  const ChartFrame frame{.columns = 4, .rows = 2, .begin_s = 0, .end_s = 8, .utf8 = true};
  const Bounds bounds = bounds_of(points, &TracePoint::raw_deg_per_h, frame);
  EXPECT_EQ(chart(points, &TracePoint::raw_deg_per_h, bounds, frame),
            (std::vector<std::string>{"   2.00000 │⠀⠀⠉⠉", "   1.00000 │⣀⣀⠀⠀"}));
  const ChartFrame stars{.columns = 4, .rows = 2, .begin_s = 0, .end_s = 8, .utf8 = false};
  EXPECT_EQ(chart(points, &TracePoint::raw_deg_per_h, bounds, stars),
            (std::vector<std::string>{"   2.00000 |  **", "   1.00000 |**  "}));
}

TEST(Chart, JoinsNeighboursAndLeavesGaps) {
  std::deque<TracePoint> points;
  for (const double time_s : {0.5, 1.5, 5.5, 6.5}) points.push_back({time_s, 1, 0, true});
  const ChartFrame frame{.columns = 16, .rows = 2, .begin_s = 0, .end_s = 8, .utf8 = false};
  const Bounds bounds = bounds_of(points, &TracePoint::raw_deg_per_h, frame);
  EXPECT_EQ(chart(points, &TracePoint::raw_deg_per_h, bounds, frame)[1].substr(kScaleColumns), " ***       ***  ");
}

TEST(Chart, NamesItsTimes) {
  const ChartFrame frame{.columns = 40, .rows = 2, .begin_s = 0, .end_s = 600};
  const std::string axis = time_axis(frame, "now");
  EXPECT_EQ(columns_of(axis), kScaleColumns + 40);
  EXPECT_EQ(axis.substr(kScaleColumns, 7), "-10 min");
  EXPECT_EQ(axis.substr(axis.size() - 3), "now");
}

TEST(StyledText, ColoursGoWithoutTheMeaning) {
  const Line line = {{"good", Meaning::kGood}, {" ± │"}, {" bad", Meaning::kBad}};
  EXPECT_EQ(terminal_text(line, {true, true}), "\033[32mgood\033[0m ± │\033[1;31m bad\033[0m");
  EXPECT_EQ(terminal_text(line, {false, false}), "good + |\033[1m bad\033[0m");
  EXPECT_EQ(text_of_line(fitted(line, 6)), "good …");
}

TEST_F(LiveScreen, NoTextReachesTheTerminalAsASequence) {
  for (const std::string& text : test::hostile_texts()) {
    SCOPED_TRACE(text.substr(0, 40));
    json status = status_of(text.c_str(), text.c_str(), 0.1);
    for (const char* key : {"name", "detail", "device", "frames"}) status[key] = text;
    status["model"] = {{"name", text}};
    for (const bool several : {false, true}) {
      View view(text, true);
      if (several) status["axes"] = {{text, status}, {"x", status}};
      view.status(status, 0);
      view.window({{"axis", text}, {"time_s", 1}}, 0);
      view.event({{"time_s", 1}, {"severity", text}, {"text", text}});
      for (const char* gone : {"", text.c_str()}) {
        if (*gone != '\0') view.gone(gone);
        for (const Line& line : view.lines({}, 0.1, "12:00:00 UTC")) {
          EXPECT_TRUE(is_printable(text_of_line(line))) << text_of_line(line);
          EXPECT_LE(columns_of(line), 80);
        }
      }
    }
  }
}

TEST_F(LiveScreen, AnyTypeIsShown) {
  const std::vector<json> others = {nullptr, true, -1, 1e300, "text", json::array({1, "a"}), {{"a", {{"b", 1}}}}};
  for (const json& other : others) {
    View view("g", true);
    json status = status_of("receiving", "good", 0.1);
    for (auto& [key, value] : status.items()) value = other;
    EXPECT_NO_THROW({
      view.history(other, 0);
      view.window(other, 0);
      view.status(status, 0);
      view.status(other, 0);
      view.window({{"axis", other}, {"time_s", other}}, 0);
      view.events(other);
      view.event({{"time_s", other}, {"text", other}});
      view.history({{"axes", {{"x", other}}}}, 0);
      (void)view.lines({}, 0.1, "12:00:00 UTC");
    }) << other;
  }
}

}  // namespace
}  // namespace prism::screen
