// SPDX-License-Identifier: MIT
// The verdicts of the monitor on constructed means: holds, each kind of drift, too little seen.
#include "tools/prismcal/model_monitor.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "tests/support/random_series.hpp"

namespace prism::analysis {
namespace {

using compensation::MonitorSettings;
using testing::HasSubstr;

constexpr double kSd = 0.007;
constexpr int kDay = 864;
constexpr std::int64_t kBegin_s = 1'767'225'600;  // 2026-01-01
const MonitorSettings kSettings{.sd_deg_per_h = kSd, .offset_deg_per_h = 0.3 * kSd, .threshold = 14, .delay_h = 0.8};

compensation::ModelInfo info() {
  compensation::ModelInfo info;
  info.inputs = {"T"};
  info.domain = {{-20}, {60}};
  return info;
}

/// Days of a daily cycle from `low` to `high`, a switch-on each, with an error by day and temperature.
std::vector<RestMean> days(int count, double low, double high,
                           const std::function<double(double day, double degc)>& error, double noise = 1) {
  test::Normal normal(1);
  std::vector<RestMean> means;
  for (int i = 0; i < count * kDay; ++i) {
    const double day = i / double(kDay), degc = (low + high) / 2 - (high - low) / 2 * std::cos(2 * M_PI * day);
    means.push_back({kBegin_s + 100 * (i + 1), degc, error(day, degc) + noise * kSd * normal(), i / kDay});
  }
  return means;
}

MonitorResult on(const std::vector<RestMean>& means) { return monitor(info(), kSettings, means, 0); }

TEST(ModelMonitor, AQuietLogHolds) {
  const MonitorResult result = on(days(31, -15, 55, [](double, double) { return 0; }));
  EXPECT_EQ(result.text, "holds: 31 days, 744 h at rest, -15 to 55 degC seen");
  EXPECT_EQ(result.tables[0].rows.size(), 8u) << "10 degC each";
  EXPECT_EQ(result.tables[1].rows.size(), 31u);
  EXPECT_EQ(result.tables[1].caption, "Repeatability (1 sigma): 0.0003 deg/h.");
  EXPECT_THAT(result.plain_text(), HasSubstr("Repeatability"));
  EXPECT_THAT(result.json_text(), HasSubstr("\"verdict\": \"holds\""));
}

TEST(ModelMonitor, AnOffsetEverywhereIsDated) {
  const MonitorResult result = on(days(20, -15, 55, [](double day, double) { return day < 10.5 ? 0 : 0.02; }));
  EXPECT_EQ(result.verdict, "drifted");
  EXPECT_THAT(result.text, HasSubstr("drifted since 2026-01-11: +0.0202 ± 0.000"));
  EXPECT_THAT(result.cause, HasSubstr("an offset at all temperatures"));
  EXPECT_THAT(result.plain_text(), HasSubstr("Offset of each switch-on"));
}

TEST(ModelMonitor, AThermalDriftHasItsTemperatures) {
  const auto hot = [](double day, double degc) { return day < 10 || degc < 30 ? 0 : 0.001 * (degc - 30); };
  const MonitorResult result = on(days(20, -15, 55, hot));
  EXPECT_THAT(result.text, HasSubstr("drifted since 2026-01-11: +0.0"));
  EXPECT_THAT(result.text, HasSubstr(" above 20 degC"));
  EXPECT_THAT(result.cause, HasSubstr("a slope over temperature"));
}

TEST(ModelMonitor, MoreNoiseIsNoOffset) {
  std::vector<RestMean> means = days(10, -15, 55, [](double, double) { return 0; });
  std::vector<RestMean> loud = days(
      20, -15, 55, [](double, double) { return 0; }, 3);
  means.insert(means.end(), loud.begin() + 10 * kDay, loud.end());
  EXPECT_THAT(on(means).cause, HasSubstr("more noise"));
}

TEST(ModelMonitor, ADriftThatEndsIsOver) {
  const auto passing = [](double day, double) { return day > 5 && day < 6 ? 0.02 : 0; };
  EXPECT_EQ(on(days(20, -15, 55, passing)).verdict, "holds");
}

TEST(ModelMonitor, TooLittleIsSeenOfAShortOrNarrowLog) {
  EXPECT_EQ(on({}).verdict, "too_little");
  std::vector<RestMean> means = days(1, -15, 55, [](double, double) { return 0; });
  means.resize(36);
  EXPECT_EQ(on(means).text, "too little seen: 1 of 2 h at rest");
  EXPECT_EQ(on(days(10, 20.5, 25.5, [](double, double) { return 0; })).text, "too little seen: 6 of 80 degC");
}

}  // namespace
}  // namespace prism::analysis
