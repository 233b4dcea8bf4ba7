// SPDX-License-Identifier: MIT
// The reports of an axis about its rows: sensors that become implausible, jump and stay, or are constant.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "compensation/plausibility.hpp"
#include "daemon/pipeline/device.hpp"
#include "tests/support/blocks.hpp"

namespace prism::pipeline {
namespace {

// A block: rows, each line followed by what is reported then (+: a problem begins, -: it ends), and "reload".
TEST(AxisRecord, ReportsWhatTheRowsSay) {
  for (const test::Block& block : test::blocks("pipeline/axis_record.txt", -2)) {
    std::vector<std::string> found;
    Problems problems([&](bool begins, const std::string& kind, const std::string& text) {
      found.push_back((begins ? "+ " : "- ") + kind + ": " + text);
    });
    AxisRecord axis;
    axis.prefix = "z: ";
    const compensation::PlausibilityLimits limits;
    compensation::SensorCheck rate(limits.rate), temperature(limits.temperature);
    const SensorList list = std::make_shared<const std::vector<SensorName>>(std::vector<SensorName>{{"case", "degC"}});
    std::int64_t second = 1'795'425'060;
    for (const std::string& line : block.lines) {
      if (line[0] == '+' || line[0] == '-') continue;
      found.push_back(line);
      if (line == "reload") axis.changes.forget(), problems.clear_all("question", "ended: ");
      std::istringstream words(line);
      int rows = 0;
      std::string times, degc;
      double case_degc = 20, rate_deg_per_h = 8;
      words >> rows >> times >> degc >> case_degc >> rate_deg_per_h;
      for (int i = 0; i < rows; ++i) {
        const double wave = std::sin(static_cast<double>(++second));
        compensation::CompensatedWindow row;
        compensation::SecondMean& mean = row.window.second_mean;
        mean.second = second;
        mean.sensor_list = list;
        mean.sensors = {case_degc};
        mean.rate_deg_per_h = rate_deg_per_h + 0.1 * wave;
        mean.temperature_degc =
            degc == "unknown" ? kUnknown : std::stod(degc) + (degc.ends_with('~') ? 0.001 * wave : 0);
        mean.implausible.rate = !rate.check(mean.rate_deg_per_h, second * 1'000'000'000);
        mean.implausible.temperature =
            degc != "unknown" && !temperature.check(mean.temperature_degc, second * 1'000'000'000);
        mean.all_implausible = mean.implausible;
        row.rejections = {rate.rejection(), temperature.rejection(), {}};
        axis.watch(
            row, [](auto, auto&, auto&) {}, problems);
      }
    }
    EXPECT_EQ(found, block.lines) << block.where;
  }
}

}  // namespace
}  // namespace prism::pipeline
