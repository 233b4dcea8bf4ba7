// SPDX-License-Identifier: MIT
// The data-quality check before training: good records pass, each defect has its finding; also for real records.
#include "compensation/evaluation/data_quality.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <sstream>
#include <string>
#include <vector>

#include "compensation/evaluation/irregularities.hpp"
#include "tests/support/random_series.hpp"
#include "tests/support/scripts.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::evaluation {
namespace {

/// A record of 924 blocks: temperature −40 to 70 degC, bias that follows it (±0.03 deg/h), noise 0.007 deg/h. Commands
/// change its rate r or temperature t; "check" prints the verdict and the findings.
class QualityPlayer {
 public:
  QualityPlayer() {
    for (std::size_t i = 0; i < 924; ++i) {
      t_.push_back(15 + 55 * std::sin(static_cast<double>(i) / 140));
      r_[i] += 8.4652 + 0.03 * std::sin(static_cast<double>(i) / 140);
    }
  }

  std::vector<std::string> play(const std::string& command, std::istream& words) {
    using test::next;
    if (command == "check") return check();
    std::vector<double>& values = next<std::string>(words) == "t" ? t_ : r_;
    const auto first = next<std::size_t>(words);
    const std::size_t end = first + next<std::size_t>(words);
    const auto a = next<double>(words), b = next<double>(words);
    if (command == "cut") {  // r FIRST COUNT: of both
      const auto erase = [&](auto& from) {
        from.erase(from.begin() + static_cast<std::ptrdiff_t>(first), from.begin() + static_cast<std::ptrdiff_t>(end));
      };
      erase(r_), erase(t_);
      if (first == 0 || first == r_.size()) return {};
      order_.follows.assign(r_.size(), true);
      order_.missing.assign(r_.size(), 0);
      order_.follows[0] = order_.follows[first] = false;
      order_.missing[first] = static_cast<double>(end - first);
      return {};
    }
    const std::vector<double> noise = test::white_noise(values.size(), a, 42);
    for (std::size_t i = first; i < std::min(end, values.size()); ++i) {
      const auto at = static_cast<double>(i);
      if (command == "add") values[i] += a;
      if (command == "every" && (i - first) % static_cast<std::size_t>(b) == 0) values[i] += a;
      if (command == "set") values[i] = a;
      if (command == "scale") values[i] = b + (values[i] - b) * a;
      if (command == "round") values[i] = a * std::round(values[i] / a);
      if (command == "noise") values[i] += noise[i];
      if (command == "wave") values[i] += a * std::sin(at / b);
    }
    return {};
  }

 private:
  std::vector<std::string> check() const {
    const DataQuality report = check_data_quality(t_, r_, order_, "x").value();
    std::vector<std::string> lines = {fmt::format("{}{}", verdict_text(report.verdict),
                                                  report.nothing_to_compensate ? ", nothing to compensate" : "")};
    for (const Finding& finding : report.findings)
      lines.push_back(fmt::format("{} {}: {}{}", verdict_text(finding.verdict), finding.name, finding.text,
                                  finding.block ? fmt::format(" @{}+{}", *finding.block, finding.run) : ""));
    return lines;
  }

  std::vector<double> t_, r_ = test::white_noise(924, 0.007, 41);
  Order order_;
};

TEST(DataQuality, Scripts) { test::expect_scripts<QualityPlayer>("evaluation/data_quality.txt"); }

TEST(DataQuality, RejectsASingleBlock) {
  const std::vector<double> one = {1.0};
  EXPECT_EQ(check_data_quality(one, one, {}, "log.csv").error().text(), "log.csv: found 1 blocks, expected at least 2");
}

// Axes x, y and z of a real gyro in a chamber, in blocks of 100 s and 10 s; system.140 has a real room.
TEST(DataQuality, AcceptsARealChamberCycle) {
  const auto path = test::shared_dir() / "data" / "mems_chamber_tofupilot.csv";
  PRISM_NEEDS(path);
  for (const int column : {2, 3, 4}) {
    for (const double length_s : {100, 10}) {
      std::istringstream lines(test::read_file(path));
      std::string line;
      std::getline(lines, line);
      std::vector<double> temperature, rate, rows;
      for (int row = 0; std::getline(lines, line); ++row) {  // each 0.505 s
        if (static_cast<std::size_t>((row + 0.5) * 0.505 / length_s) == rows.size())
          temperature.push_back(0), rate.push_back(0), rows.push_back(0);
        ++rows.back();
        std::istringstream fields(line);
        for (int i = 0; std::getline(fields, line, ','); ++i) {
          if (i == 1) temperature.back() += (std::stod(line) - temperature.back()) / rows.back();
          if (i == column) rate.back() += (std::stod(line) * 3600 - rate.back()) / rows.back();
        }
      }
      temperature.pop_back(), rate.pop_back();
      const DataQuality report = check_data_quality(temperature, rate, {}, "x").value();
      for (const Finding& finding : report.findings) {
        EXPECT_NE(finding.verdict, Verdict::kRefuse) << column << " " << finding.name << ": " << finding.text;
        // Around 1 030 s axes x and z jump within one block while the temperature creeps: detected, but small.
        if (length_s < 100 && finding.name == "moved") {
          EXPECT_EQ(finding.verdict, column == 3 ? Verdict::kPass : Verdict::kWarn) << column;
        }
      }
      EXPECT_FALSE(length_s < 100 && report.nothing_to_compensate);
    }
  }
}

/// 4 000 values: drift of 1 and noise of 0.05. Commands change them, or print runs.
class RunsPlayer {
 public:
  RunsPlayer() {
    for (std::size_t i = 0; i < values_.size(); ++i) values_[i] += 8.4 + std::sin(static_cast<double>(i) / 400);
  }

  std::vector<std::string> play(const std::string& command, std::istream& words) {
    using test::next;
    std::vector<std::string> given;
    if (command == "far_runs") {  // FAR [CODE]
      const FarLimits limits{next(words, 2.5), 60, 200, true, next<double>(words)};
      for (const FarRun& run : far_runs(values_, limits))
        given.push_back(fmt::format("{} to {}: {:g} of {:.3g}", run.begin, run.end, run.level, run.rest));
    } else if (command == "constant_runs") {
      for (const ConstantRun& run : constant_runs(values_, 60))
        given.push_back(fmt::format("{} to {}{}", run.begin, run.end, run.certain ? ", certain" : ""));
    } else if (command == "noise") {
      given.push_back(fmt::format("{:.2g}", noise_of_steps(values_)));
    } else if (command == "white") {  // noise of this sd
      const std::vector<double> noise = test::white_noise(values_.size(), next<double>(words), 2);
      for (std::size_t i = 0; i < values_.size(); ++i) values_[i] += noise[i];
      return given;
    } else {  // set|add|round FIRST COUNT VALUE
      const auto first = next<std::size_t>(words), count = next<std::size_t>(words);
      const auto value = next<double>(words);
      for (std::size_t i = first; i < first + count; ++i)
        values_[i] = command == "set"   ? value
                     : command == "add" ? values_[i] + value
                                        : std::round(values_[i] / value) * value;
      return given;
    }
    return given.empty() ? std::vector<std::string>{"none"} : given;
  }

 private:
  std::vector<double> values_ = test::white_noise(4000, 0.05, 1);
};

TEST(FarRuns, Scripts) { test::expect_scripts<RunsPlayer>("evaluation/far_runs.txt"); }

}  // namespace
}  // namespace prism::evaluation
