// SPDX-License-Identifier: MIT
// The table of parameters of a recording with a known trend and known switch-ons.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compensation/evaluation/drift_fit.hpp"
#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/recording_report.hpp"

namespace prism::analysis {
namespace {

constexpr double kTrend = 0.05;  // deg/h per day

/// 400 s a day: eight days from one switch-on, then two days with a switch-on and a step of the bias each.
struct TenDays {
  TenDays() {
    test::Normal normal(3);
    std::vector<compensation::SecondMean> seconds;
    for (int day = 0; day < 10; ++day) {
      for (int i = 0; i < 400; ++i) {
        compensation::SecondMean& second = seconds.emplace_back();
        second.second = 1767225600 + day * 86400 + i;
        second.samples = 1;
        second.temperature_degc = 25;
        const double step = day == 8 ? 0.3 : day == 9 ? -0.1 : 0;
        second.rate_deg_per_h = test::kDayEarthRate + kTrend * (day + i / 86400.0) + step + 0.01 * normal();
      }
    }
    auto table =
        recordings::make_block_table(seconds, {}, test::kDayEarthRate, "ten", std::vector<std::size_t>{0, 3200, 3600})
            .value();
    auto evaluation = evaluate_model(test::linear_model(0), table, {}, evaluation::Divisor::kN).value();
    recording = evaluate_recording("r", {{}, std::move(table)}, std::move(evaluation));
  }

  std::vector<report::Cell> row(const std::string& name) const {
    const report::Table parameters = parameters_table({*recording}, std::nullopt);
    for (const auto& cells : parameters.rows) {
      if (cells[0].text.starts_with(name)) return cells;
    }
    ADD_FAILURE() << "no row " << name;
    return std::vector<report::Cell>(8, report::Cell(""));
  }

  std::optional<EvaluatedRecording> recording;
};

TEST(Parameters, ATrendIsThatOfDays) { EXPECT_NEAR(TenDays().row("trend")[2].value.value_or(0), kTrend, 0.002); }

TEST(Parameters, SwitchOnsAreComparedOverTheShortestRun) {
  const TenDays days;
  const recordings::BlockTable& table = days.recording->loaded.table;
  ASSERT_EQ(table.starts.size(), 3u);
  const std::size_t each = table.size() / 10;
  std::vector<double> means;
  for (const std::size_t day : {0, 8, 9}) {
    means.push_back(0);
    for (std::size_t i = 0; i < each; ++i)
      means.back() += table.bias_deg_per_h[day * each + i] / static_cast<double>(each);
  }
  const auto row = days.row("turn-on");
  EXPECT_NEAR(row[2].value.value_or(0), evaluation::scatter_with_interval(means).value, 1e-9);
  const double hours = (static_cast<double>(table.second(each - 1) - table.starts[0]) - 50) / 3600;
  EXPECT_EQ(row[6].text, fmt::format("means of the first {:.3g} h, chi-square", hours));
  EXPECT_EQ(row[7].text, "3 switch-ons");
}

TEST(Parameters, TheBandOfTheWarmUpIsTheNoiseOfABlockRoundedUp) {
  TenDays days;
  for (const auto& [floor, band] : {std::pair<std::optional<double>, const char*>{std::nullopt, "0.01"},
                                    {0.00055, "0.0006"},
                                    {0.0021, "0.003"},
                                    {2.5, "3"}}) {
    days.recording->evaluation.stability.floor_deg_per_h = floor;
    days.row(fmt::format("warm-up to within {} deg/h", band));
  }
}

}  // namespace
}  // namespace prism::analysis
