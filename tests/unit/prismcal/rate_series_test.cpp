// SPDX-License-Identifier: MIT
// Reading rate columns from CSV files.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "compensation/evaluation/allan.hpp"
#include "tests/support/power_law_noise.hpp"
#include "tests/support/shared_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/findings.hpp"
#include "tools/prismcal/recording.hpp"

namespace prism::prismcal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class RateSeries : public testing::Test {
 protected:
  std::string written(const std::string& text) {
    std::string path = folder_.file("series.csv");
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }

 private:
  const test::TemporaryFolder folder_;
};

recordings::RateSeriesChoice in_deg_per_h() {
  recordings::RateSeriesChoice choice;
  choice.unit = "deg/h";
  return choice;
}

TEST_F(RateSeries, ReadsPrismdsLog) {
  const auto series = recordings::read_rate_series(
      written("# prism 0.1.0 data log, format 1\ntime_utc,time_s,rate_deg_per_h\na,10,8.5\nb,11,\nc,12,8.7\n"), {});
  ASSERT_TRUE(series) << series.error().text();
  EXPECT_EQ(series->rows, 3u);
  EXPECT_EQ(series->interval_s, 1);
  EXPECT_EQ(series->interval_source, "count over span of time_s");
  EXPECT_TRUE(std::isnan(series->rate_deg_per_h[1]));
  EXPECT_EQ(series->rate_deg_per_h[2], 8.7);
}

TEST_F(RateSeries, ReadsAColumnWithoutNames) {
  const auto series = recordings::read_rate_series(written("1\n2\n\n3\r\n"), in_deg_per_h()).value();
  EXPECT_THAT(series.rate_deg_per_h, ElementsAre(1, 2, 3));
  EXPECT_EQ(series.interval_source, "assumed: the file has no time");
  recordings::RateSeriesChoice tenth = in_deg_per_h();
  tenth.table.interval_s = 0.1;
  EXPECT_EQ(recordings::read_rate_series(written("1\n2\n3\n"), tenth)->interval_s, 0.1);
}

TEST_F(RateSeries, ConvertsUnitsByColumnNameOrOption) {
  EXPECT_THAT(recordings::read_rate_series(written("t_s;rate_x_dps\n0;1\n1;2\n"), {})->rate_deg_per_h,
              ElementsAre(3600, 7200));
  recordings::RateSeriesChoice radians;
  radians.unit = "rad/s";
  EXPECT_NEAR(recordings::read_rate_series(written("1\n2\n"), radians)->rate_deg_per_h[0], 206264.806, 0.001);
  radians.unit = "furlong";
  EXPECT_THAT(recordings::read_rate_series(written("1\n2\n"), radians).error().text(),
              HasSubstr("--unit: found \"furlong\", expected deg/h"));
}

// It was taken for deg/h: a rate in rad/s was 206265 times too small.
TEST_F(RateSeries, ARateWithoutAUnitIsAnError) {
  EXPECT_EQ(recordings::read_rate_series(written("t_s,gyro_z\n0,1\n1,2\n"), {}).error().text(),
            "--unit: found none, and no unit in the header of column gyro_z, expected deg/h, deg/s, rad/s or arcsec/s");
  EXPECT_THAT(recordings::read_rate_series(written("1\n2\n"), {}).error().text(),
              HasSubstr("column 1, expected deg/h"));
}

TEST_F(RateSeries, TreatsAJumpInTimeAsMissingValues) {
  std::string text = "time_s\trate_deg_per_h\n";
  for (int second = 0; second < 100; ++second) {
    if (second != 40 && second != 41) text += std::to_string(second) + "\t" + std::to_string(second % 3) + "\n";
  }
  const auto series = recordings::read_rate_series(written(text), {}).value();
  ASSERT_EQ(series.rate_deg_per_h.size(), 100u);
  EXPECT_TRUE(std::isnan(series.rate_deg_per_h[40]) && std::isnan(series.rate_deg_per_h[41]));
  EXPECT_EQ(series.rate_deg_per_h[42], 0);
}

TEST_F(RateSeries, ALongGapSeparatesTwoRecords) {
  const auto series =
      recordings::read_rate_series(written("time_s\trate_deg_per_h\n1\t5\n2\t6\n3\t5\n9\t5\n10\t5\n"), {}).value();
  ASSERT_EQ(series.rate_deg_per_h.size(), 6u);
  EXPECT_EQ(series.rate_deg_per_h[3], evaluation::kAllanBreak);
}

/// Noise of 0.01 around 8 with the rows `wrong` at a value.
std::vector<double> noise_with(std::size_t rows, const std::vector<std::size_t>& wrong, double value) {
  test::NormalPairs normal(3);
  std::vector<double> rates(rows);
  for (double& rate : rates) rate = 8 + 0.01 * normal();
  for (const std::size_t row : wrong) rates[row] = value;
  return rates;
}

// They were used in silence: five of -999 made N 200 times too large.
TEST_F(RateSeries, CodesForNoValueAreNotUsed) {
  const auto judged = [&](const std::vector<double>& rates) {
    std::string text = "t_s,rate_deg_per_h\n";
    for (std::size_t i = 0; i < rates.size(); ++i) text += fmt::format("{},{:.9f}\n", i, rates[i]);
    return recordings::read_rate_series(written(text), {}).value();
  };
  const auto five = judged(noise_with(1000, {400, 401, 402, 403, 404}, -999));
  EXPECT_THAT(five.notes, ElementsAre(HasSubstr("rate: 5 rows from 400 s to 404 s at -999 deg/h, far from the rest")));
  for (std::size_t i = 395; i < 410; ++i) EXPECT_EQ(std::isnan(five.rate_deg_per_h[i]), i >= 400 && i < 405) << i;
  const auto zeros = judged(noise_with(1000, {10, 100, 300, 301, 500, 700, 998}, 0));
  EXPECT_THAT(zeros.notes, testing::Contains(HasSubstr("1 run more at 0 deg/h")));
  EXPECT_TRUE(std::isnan(zeros.rate_deg_per_h[998]));
  std::vector<double> stopped = noise_with(4000, {}, 0);
  std::fill_n(stopped.begin() + 1000, 500, 8.003);
  EXPECT_THAT(judged(stopped).notes, ElementsAre(HasSubstr("rate is constant at 8.003 deg/h from 1000 s to 1499 s")));
  EXPECT_TRUE(judged(noise_with(1000, {}, 0)).notes.empty());
}

// Of a long series, only the row that is wrong.
TEST_F(RateSeries, JudgesALongSeriesExactly) {
  constexpr std::size_t kRows = 1'000'003, kWrong = 777'777;
  std::vector<double> series = noise_with(kRows, {kWrong}, -999);
  const auto findings = recordings::judge_rates(series, {1, 0.005});
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_THAT(findings[0].text, HasSubstr("rate: outlier at row 777778: -999 deg/h"));
  EXPECT_EQ(findings[0].begin, 777777);
  EXPECT_EQ(std::count_if(series.begin(), series.end(), [](double rate) { return std::isnan(rate); }), 1);
  EXPECT_TRUE(std::isnan(series[kWrong]));
}

TEST_F(RateSeries, ReadsMinutesAndHours) {
  EXPECT_EQ(recordings::read_rate_series(written("Time [min],rate_dps\n1,1\n2,2\n3,1\n"), {})->interval_s, 60);
  EXPECT_EQ(recordings::read_rate_series(written("t / h,rate_dps\n1,1\n2,2\n3,1\n"), {})->interval_s, 3600);
}

// It assumed 1 s and said that the file has no time.
TEST_F(RateSeries, ATimeThatItCannotReadIsAnError) {
  const std::string rows = "Time,rate_dps\n12:00:00:000,1\n12:00:00:100,2\n12:00:00:200,1\n";
  recordings::RateSeriesChoice choice;
  choice.column = "rate_dps";
  EXPECT_THAT(
      recordings::read_rate_series(written(rows), choice).error().text(),
      HasSubstr(
          "column Time: found \"12:00:00:000\", expected a time as 2024-03-01 12:00:05.250 or a number; prism-import"));
  choice.table.interval_s = 0.1;
  EXPECT_EQ(recordings::read_rate_series(written(rows), choice)->interval_s, 0.1);
  EXPECT_EQ(recordings::read_rate_series(written("rate_dps,flag\n1,on\n2,off\n"), {}).error().text().find("time"),
            std::string::npos);
}

TEST_F(RateSeries, AFactorInTheHeaderIsNoUnit) {
  for (const char* name : {"Rate x1000 [deg/h]", "1000*Rate (deg/h)", "Rate / 10^-3 deg/h", "Rate*100 (deg/h)",
                           "Rate e-3 (deg/h)", "log10 Rate (deg/h)"})
    EXPECT_THAT(recordings::read_rate_series(written(fmt::format("t_s,{}\n0,1\n1,2\n", name)), {}).error().text(),
                HasSubstr("found none, and no unit in the header"))
        << name;
  for (const char* name : {"rate_x10 (deg/h)", "gyro_x 100Hz (deg/h)", "datalog1_deg_h"})
    EXPECT_TRUE(recordings::read_rate_series(written(fmt::format("t_s,{}\n0,1\n1,2\n", name)), {})) << name;
}

TEST_F(RateSeries, ASecondTimeIsNamed) {
  recordings::RateSeriesChoice choice;
  choice.column = "rate_dps";
  std::string understood;
  choice.table.announce = [&](const std::string& text) { understood = text; };
  ASSERT_TRUE(recordings::read_rate_series(written("t (s),rate_dps,t2 (s)\n0,1,0\n1,2,3\n"), choice));
  EXPECT_THAT(understood, HasSubstr("; not read: t2 (s), a second time"));
}

TEST_F(RateSeries, ReportsErrorsWithFileAndLine) {
  EXPECT_THAT(recordings::read_rate_series("/nowhere.csv", {}).error().text(),
              "/nowhere.csv: cannot be read: No such file or directory");
  EXPECT_THAT(recordings::read_rate_series(written(""), {}).error().text(), HasSubstr("no row of numbers"));
  EXPECT_THAT(recordings::read_rate_series(written("time_s,rate_dps\n1,2\n2,x\n"), {}).error().text(),
              HasSubstr(".csv:3: column rate_dps: found \"x\", expected a number"));
  EXPECT_THAT(recordings::read_rate_series(written("time_s,rate_dps\n2,1\n1,1\n"), {}).error().text(),
              HasSubstr(":3: found time 1 s after 2 s, expected increasing times"));
  EXPECT_THAT(recordings::read_rate_series(written("a,b,c\n1,2,3\n"), {}).error().text(),
              HasSubstr("found columns a, b, c, expected --column NAME"));
  recordings::RateSeriesChoice missing;
  missing.column = "z";
  EXPECT_THAT(recordings::read_rate_series(written("a,b\n1,2\n"), missing).error().text(),
              HasSubstr("found no column \"z\", expected a number from 1 to 2 or one of a, b"));
}

TEST_F(RateSeries, ReadsARealRecord) {
  PRISM_NEEDS_SHARED("data/mems_chamber_tofupilot.csv");
  recordings::RateSeriesChoice choice;
  choice.column = "rate_y_dps";
  const auto series =
      recordings::read_rate_series((test::shared_dir() / "data/mems_chamber_tofupilot.csv").string(), choice).value();
  EXPECT_EQ(series.rows, 8400u);
  EXPECT_NEAR(series.interval_s, 0.505, 0.001);
  const auto analysis = evaluation::analyse_allan(series.rate_deg_per_h, series.interval_s, "x").value();
  EXPECT_TRUE(analysis.coefficients);
}

}  // namespace
}  // namespace prism::prismcal
