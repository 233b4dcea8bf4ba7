// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "tools/prismweb/history.hpp"

namespace prism::prismweb {
namespace {

Period second(std::int64_t begin_s, double rate) {
  compensation::CompensatedWindow row;
  row.window.second_mean.second = begin_s;
  row.window.second_mean.rate_deg_per_h = rate;
  row.window.second_mean.samples = 200;
  return second_of(row);
}

std::vector<Period> noise(std::size_t count, std::int64_t begin_s) {
  std::mt19937 random(5);
  std::normal_distribution<double> rate;
  std::vector<Period> seconds;
  for (std::size_t i = 0; i < count; ++i) {
    const bool known = random() % 7 != 0;
    seconds.push_back(second(begin_s + static_cast<std::int64_t>(i), known ? rate(random) : std::nan("")));
  }
  return seconds;
}

// Compares with a direct computation for various steps, starts, and a clock that was set back.
TEST(Downsample, KeepsExtremesAndCounts) {
  for (const std::int64_t begin_s : {-5003L, 0L, 1795425007L}) {
    std::vector<Period> seconds = noise(5000, begin_s);
    const std::vector<Period> again = noise(50, begin_s + 100);  // the clock was set back
    seconds.insert(seconds.end(), again.begin(), again.end());
    for (const std::int64_t step_s : {1, 2, 7, 60, 3600}) {
      const std::vector<Period> steps = downsample(seconds, begin_s + 10, begin_s + 4900, step_s);
      double rows = 0;
      for (std::size_t i = 0; i < steps.size(); ++i) {
        ASSERT_TRUE(i == 0 || steps[i].begin_s >= steps[i - 1].begin_s + step_s);
        ASSERT_EQ(floor_to(steps[i].begin_s, step_s), steps[i].begin_s);
        double min = std::nan(""), max = std::nan(""), sum = 0, known = 0;
        for (const Period& one : seconds) {
          const bool within = one.begin_s >= steps[i].begin_s && one.begin_s < steps[i].begin_s + step_s &&
                              one.begin_s >= begin_s + 10 && one.begin_s < begin_s + 4900;
          const double rate = one.values[kRateMin];
          if (!within || std::isnan(rate)) continue;
          min = std::fmin(min, rate);
          max = std::fmax(max, rate);
          sum += rate;
          ++known;
        }
        const auto& found = steps[i].values;
        ASSERT_TRUE(min == found[kRateMin] || (std::isnan(min) && std::isnan(found[kRateMin])));
        ASSERT_TRUE(max == found[kRateMax] || (std::isnan(max) && std::isnan(found[kRateMax])));
        ASSERT_EQ(known, found[kRateKnown]);
        ASSERT_NEAR(sum, found[kRateSum], 1e-9);
        ASSERT_EQ(found[kCorrectedKnown], 0);
        ASSERT_EQ(found[kSamples], 200 * found[kSeconds]);
        ASSERT_TRUE(std::isnan(found[kUhfoMin]));
        rows += found[kSeconds];
      }
      EXPECT_EQ(rows, 4890 + 50);
    }
  }
}

TEST(Downsample, StepsRespectTheNumberOfPoints) {
  EXPECT_EQ(step_for(3600, 5000, 1), 1);
  EXPECT_EQ(step_for(3600, 1000, 1), 5);
  EXPECT_EQ(step_for(3600, 5000, 60), 60);
  EXPECT_EQ(step_for(30 * 86400.0, 1000, 60), 3600);
  EXPECT_EQ(step_for(86400.0, 1, 1), 86400);
  for (const double length_s : {1.0, 59.0, 3601.0, 86400.0, 3e7, 9e9}) {
    for (const int points : {2, 10, 999, 5000}) {
      const std::int64_t step_s = step_for(length_s, points, 1);
      EXPECT_LE(length_s / static_cast<double>(step_s) + 1, points) << length_s << " " << points;
    }
  }
}

TEST(RecentSeconds, AreSortedWithoutDuplicates) {
  RecentSeconds recent;
  const auto all = [&] { return recent.after(INT64_MIN); };
  for (const std::int64_t begin_s : {5, 6, 8, 7, 6}) recent.put(second(begin_s, static_cast<double>(begin_s)));
  recent.put(second(7, 70));
  ASSERT_EQ(all().size(), 4U);
  EXPECT_EQ(all()[2].values[kRateMin], 70);
  for (std::int64_t begin_s = 0; begin_s < 20000; ++begin_s) recent.put_now(second(begin_s, 0));
  EXPECT_EQ(all().size(), std::size_t{RecentSeconds::kLength_s});
  recent.put(second(1, 0));
  EXPECT_GT(recent.first_s(), 1) << "too old";
  recent.put_now(second(100, 0));
  EXPECT_EQ(all().size(), 1U) << "the device clock was reset";
  recent.put(second(20000, 0));
  recent.put(second(99, 0));
  EXPECT_EQ(recent.last_s(), 100) << "the log is read later than the seconds come: a second from before the reset";
  EXPECT_EQ(recent.first_s(), 99);
  recent.forget_now();
  recent.put(second(101, 0));
  EXPECT_EQ(recent.last_s(), 101);
}

TEST(Windows, AreConvertedToSeconds) {
  const auto read = second_of(nlohmann::json::parse(
      R"({"axis":"z","time_s":100,"samples":200,"missing":1,"rate_deg_per_h":1.5,"corrected_deg_per_h":null,"quality":"good"})"));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->begin_s, 99);
  EXPECT_EQ(read->values[kRateMin], 1.5);
  EXPECT_TRUE(std::isnan(read->values[kCorrectedMax]));
  EXPECT_EQ(read->values[kGood], 1);
  EXPECT_FALSE(second_of(nlohmann::json("x")));
  EXPECT_FALSE(second_of(nlohmann::json::parse(R"({"time_s":"x"})")));
}

TEST(Windows, HaveTheSensorsThatAreKnown) {
  const auto read = second_of(nlohmann::json::parse(R"({"time_s":100,"sensors":{"case":25.5,"chamber.t":null}})"));
  const std::map<std::string, std::array<double, 2>> expected = {{"case", {25.5, 25.5}}};
  EXPECT_EQ(read->sensors, expected);
}

// If the temperature rises by 0.01 degC/s, the mean of 100 s lags by half a degree. Joined to the seconds of the log,
// it showed a step at the first second in memory.
TEST(Windows, UseTheTemperatureAndVoltageOfTheSecond) {
  const auto read = [](const char* text) { return second_of(nlohmann::json::parse(text)).value(); };
  const auto now =
      read(R"({"time_s":100,"temperature_degc":25.5,"mean_temperature_degc":25,"uhfo_v":5.4,"mean_uhfo_v":5.3})");
  EXPECT_EQ(now.values[kTemperatureMin], 25.5);
  EXPECT_EQ(now.values[kUhfoMin], 5.4);
  const auto failed = read(R"({"time_s":100,"temperature_degc":null,"mean_temperature_degc":25})");
  EXPECT_TRUE(std::isnan(failed.values[kTemperatureMin]));
}

}  // namespace
}  // namespace prism::prismweb
