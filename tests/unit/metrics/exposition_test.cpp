// SPDX-License-Identifier: MIT
// Prometheus' text format: a complete small example, and the metrics of a gyro's responses.
#include "tools/metrics/exposition.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <utf8.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/support/hostile_texts.hpp"
#include "tests/support/shared_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/metrics/families.hpp"

namespace prism::metrics {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

constexpr Family kRate{"prism_rate", Type::kGauge, "A \\ rate\nof it."};
constexpr Family kCount{"prism_count_total", Type::kCounter, "A count."};

TEST(Exposition, AFamilyStandsTogetherWhateverTheOrder) {
  Exposition out;
  out.add(kRate, {{"gyro", "a"}}, 0.1);
  out.add(kCount, {}, 12345678901234567.0);
  out.add(kRate, {{"gyro", "q\"\\\n"}, {"axis", "x"}}, -2);
  out.add(kRate, {}, std::nan(""));
  out.add(kRate, {}, INFINITY);
  EXPECT_EQ(
      out.text(),
      "# HELP prism_count_total A count.\n# TYPE prism_count_total counter\nprism_count_total 1.2345678901234568e+16\n"
      "# HELP prism_rate A \\\\ rate\\nof it.\n# TYPE prism_rate gauge\nprism_rate{gyro=\"a\"} 0.1\n"
      "prism_rate{gyro=\"q\\\"\\\\\\n\",axis=\"x\"} -2\n");
}

TEST(Exposition, IsWrittenAsAWholeForEverybody) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("prism.prom");
  ASSERT_TRUE(write_exposition(path, "one\n"));
  ASSERT_TRUE(write_exposition(path, "two\n"));
  EXPECT_EQ(test::read_file(path), "two\n");
  struct stat facts {};
  ASSERT_EQ(::stat(path.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0644u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.file("")), {}), 1);
  EXPECT_FALSE(write_exposition(folder.file("no/such/folder.prom"), "x"));
}

json status_of(const std::string& quality) {
  return {{"state", "receiving"},
          {"age_s", 0.25},
          {"health", {{"problems", {{{"text", "log: full"}}, {{"text", "line: silent"}}}}}},
          {"started_s", 1000.5},
          {"line", {{"frames", 7}, {"bad_check", 2}}},
          {"timing", {{"missing_frames", 3}, {"resets", 1}}},
          {"axes", {{"z", {{"quality", quality}, {"window", {{"rate_deg_per_h", 8.5}, {"bias_deg_per_h", nullptr}}}}}}},
          {"log", {{"rows", 10}, {"dropped", 0}, {"gone", 4}}},
          {"sensors", {{"case", {{"value", 23.5}, {"unit", "degC"}}}, {"anode", {{"value", nullptr}, {"unit", "V"}}}}}};
}

std::string text_of(const GyroAnswers& answers) {
  Exposition out;
  add_gyro(out, "gyro1", answers);
  return out.text();
}

TEST(GyroMetrics, WhatIsKnownHasASampleAndWhatIsNotHasNone) {
  const std::string text = text_of({status_of("warming+implausible"), {}, {}});
  for (const char* line :
       {"prism_up{gyro=\"gyro1\"} 1\n", "prism_problems{gyro=\"gyro1\"} 2\n",
        "prism_line_receiving{gyro=\"gyro1\"} 1\n", "prism_rate_degrees_per_hour{gyro=\"gyro1\",axis=\"z\"} 8.5\n",
        "prism_quality_good{gyro=\"gyro1\",axis=\"z\"} 0\n",
        "prism_quality_reason{gyro=\"gyro1\",axis=\"z\",reason=\"warming\"} 1\n",
        "prism_quality_reason{gyro=\"gyro1\",axis=\"z\",reason=\"implausible\"} 1\n",
        "prism_line_refused_total{gyro=\"gyro1\",reason=\"bad_check\"} 2\n",
        "prism_log_gone_rows_total{gyro=\"gyro1\"} 4\n", "prism_sensor_celsius{gyro=\"gyro1\",sensor=\"case\"} 23.5\n"})
    EXPECT_THAT(text, HasSubstr(line));
  for (const char* absent : {"prism_bias_degrees", "prism_sensor_volts", "null", "nan"})
    EXPECT_THAT(text, Not(HasSubstr(absent)));
  EXPECT_THAT(text_of({status_of("good"), {}, {}}), Not(HasSubstr("prism_quality_reason")));
}

TEST(GyroMetrics, AGyroThatDoesNotAnswerIsDownAndNothingElse) {
  const std::string text = text_of({});
  EXPECT_THAT(text, HasSubstr("prism_up{gyro=\"gyro1\"} 0\n"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3);
}

TEST(GyroMetrics, EachAxisHasItsOwn) {
  json status = status_of("good");
  const json own = {{"quality", "good"}, {"window", {{"rate_deg_per_h", 1}}}};
  status["axes"] = {{"x", own}, {"y", own}};
  const std::string text = text_of({status, {}, {{"axes", {{"y", {{"raw", {{"sd_deg_per_h", 0.02}}}}}}}}});
  EXPECT_THAT(text, HasSubstr("prism_rate_degrees_per_hour{gyro=\"gyro1\",axis=\"x\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("prism_rate_degrees_per_hour{gyro=\"gyro1\",axis=\"y\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("prism_stability_degrees_per_hour{gyro=\"gyro1\",axis=\"y\",of=\"raw\"} 0.02\n"));
  EXPECT_THAT(text, Not(HasSubstr("axis=\"x\",of")));
}

/// Returns name and labels of a sample line; empty if the line is invalid.
std::string series_of(const std::string& line) {
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (quoted && line[i] == '\\') {
      if (++i == line.size() || std::string("\\n\"").find(line[i]) == std::string::npos) return "";
    } else if (line[i] == '"') {
      quoted = !quoted;
    } else if (!quoted && line[i] == ' ') {
      return line.find(' ', i + 1) == std::string::npos ? line.substr(0, i) : "";
    }
  }
  return "";
}

TEST(RelayMetrics, AStoppedRelayHasNoOldValues) {
  const json status = {
      {"time_s", 100},
      {"site", "lab"},
      {"targets", {{"mqtt", {{"up", false}, {"failures", 3}, {"last_s", nullptr}}}}},
      {"logs", {{{"gyro", "lab/g"}, {"axis", "z"}, {"rows", 7}, {"behind_s", 0.5}, {"lag_s", nullptr}}}}};
  Exposition runs, stopped;
  add_relay(runs, status, 105);
  for (const char* line :
       {"prism_relay_up{site=\"lab\"} 1\n", "prism_relay_target_up{site=\"lab\",target=\"mqtt\"} 0\n",
        "prism_relay_failures_total{site=\"lab\",target=\"mqtt\"} 3\n",
        "prism_relay_rows_total{site=\"lab\",gyro=\"g\",axis=\"z\"} 7\n",
        "prism_relay_behind_seconds{site=\"lab\",gyro=\"g\",axis=\"z\"} 0.5\n"})
    EXPECT_THAT(runs.text(), HasSubstr(line));
  for (const char* absent : {"prism_relay_lag", "prism_relay_last", "null", "nan"})
    EXPECT_THAT(runs.text(), Not(HasSubstr(absent)));
  add_relay(stopped, status, 111);
  EXPECT_THAT(stopped.text(), HasSubstr("prism_relay_up{site=\"lab\"} 0\n"));
  EXPECT_THAT(stopped.text(), Not(HasSubstr("prism_relay_rows")));
}

// One line that Prometheus does not accept, or one series twice, voids the scrape of all gyros.
TEST(GyroMetrics, EveryTextLeavesTheScrapeValid) {
  for (const std::string& text : test::hostile_texts()) {
    SCOPED_TRACE(text.substr(0, 40));
    json status = status_of(text);
    for (const char* key : {"version", "frames", "gyro_serial", "state"}) status[key] = text;
    json axis = status["axes"]["z"];
    axis["model"] = {{"kind", text}, {"name", text}, {"id", text}};
    status["axes"] = {{"x", axis}, {text, axis}, {text + "\xff", axis}, {text + "\xfe", axis}};
    status["sensors"] = {{text, {{"value", 1}, {"unit", "V"}}}, {"s", {{"value", 1}, {"unit", text}}}};
    status["sensor_lines"] = {{text, {{"state", text}}}};
    Exposition out;
    add_gyro(out, text, {status, {}, {}});
    add_gyro(out, "good", {status_of("good"), {}, {}});
    std::set<std::string> series;
    std::istringstream lines(out.text());
    for (std::string line; std::getline(lines, line);) {
      ASSERT_TRUE(utf8::is_valid(line));
      ASSERT_EQ(line.find('\0'), std::string::npos);
      ASSERT_EQ(line.find('\r'), std::string::npos);
      ASSERT_LT(line.size(), 4000u);
      if (line.starts_with("# HELP prism_") || line.starts_with("# TYPE prism_")) continue;
      const std::string own = series_of(line);
      ASSERT_TRUE(own.starts_with("prism_")) << line;
      ASSERT_TRUE(series.insert(own).second) << line;
    }
    EXPECT_EQ(series.count("prism_up{gyro=\"good\"}"), 1u);
  }
}

TEST(Exposition, WritesRegularFilesAlone) {
  const test::TemporaryFolder folder;
  const std::string target = folder.file("target"), link = folder.file("link.prom");
  std::ofstream(target) << "old";
  std::filesystem::permissions(target, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  std::filesystem::create_symlink(target, link);
  EXPECT_FALSE(write_exposition(link, "x"));
  EXPECT_EQ(test::read_file(target), "old");
  ASSERT_TRUE(write_exposition(target, "new"));
  const auto mode = [](const std::string& path) {
    struct stat facts {};
    EXPECT_EQ(::stat(path.c_str(), &facts), 0);
    return facts.st_mode & 0777;
  };
  EXPECT_EQ(mode(target), 0600u) << "an existing file keeps its mode";
  const mode_t before = ::umask(077);
  ASSERT_TRUE(write_exposition(folder.file("new.prom"), "new"));
  ::umask(before);
  EXPECT_EQ(mode(folder.file("new.prom")), 0644u);
}

}  // namespace
}  // namespace prism::metrics
