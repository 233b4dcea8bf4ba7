// SPDX-License-Identifier: MIT
// The engine and the check of a sensor as scripts: the output for streams with gaps, failed sensors and other models.
// models.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "compensation/compensated_text.hpp"
#include "compensation/compensation_engine.hpp"
#include "compensation/plausibility.hpp"
#include "tests/support/models.hpp"
#include "tests/support/scripts.hpp"

namespace prism::compensation {
namespace {

using test::linear_model;
using test::next;
using test::short_features;
using Lines = std::vector<std::string>;

double number_of(const std::string& word) { return word == "unknown" ? kUnknown : std::stod(word); }

// " NAME VALUE" with nine digits, nothing if it is unknown.
std::string shown(const char* name, double value) {
  return std::isnan(value) ? "" : fmt::format(" {} {:.9g}", name, std::fabs(value) < 1e-12 ? 0 : value);
}

std::string shown(const Correction& correction, double corrected) {
  return quality_text(correction.quality) + shown("bias", correction.bias_deg_per_h) + shown("corrected", corrected);
}

std::string shown(const CompensatedWindow& row) {
  const SecondMean& mean = row.window.second_mean;
  std::string text = fmt::format("{}{}", mean.samples, mean.partial ? " (partial) " : " ") +
                     shown(row.correction, row.corrected_deg_per_h) + shown("sd", row.correction.sd_deg_per_h) +
                     shown("mean", row.corrected_mean_deg_per_h) + shown("T", mean.temperature_degc) +
                     shown("mean T", row.window.temperature_degc) + shown("slope", row.window.slope_degc_per_s);
  if (row.rejections.temperature) text += " T " + rejection_text(row.rejections.temperature, "degC");
  if (row.rejections.rate) text += " rate " + rejection_text(row.rejections.rate, "deg/h");
  return text;
}

/// "T:0.01 U:0.1", with "length 9", "response 10", "box -30 70" (of each input) or "offset 1"; "none". Up to a slash.
ModelPtr model_of(std::istream& words) {
  std::vector<std::string> inputs;
  std::vector<double> gains;
  FeatureDefinition features = short_features();
  Domain box;
  double offset = 0;
  for (std::string word; words >> word && word != "/";) {
    if (word == "length")
      words >> features.length_s;
    else if (word == "response")
      words >> features.response_s;
    else if (word == "offset")
      words >> offset;
    else if (word == "box")
      box = {{next<double>(words)}, {next<double>(words)}};
    else if (const auto at = word.find(':'); at != std::string::npos) {
      inputs.push_back(word.substr(0, at));
      if (word.starts_with("case")) features.sensors = {{"case", "degC"}};
      gains.push_back(std::stod(word.substr(at + 1)));
    }
  }
  return inputs.empty() ? nullptr : linear_model(inputs, gains, offset, features, box);
}

/// An engine and its clock: ten samples a second, or windows of one second.
class EnginePlayer {
 public:
  EnginePlayer() {
    sample_.rate_deg_per_h = 8;
    sample_.interval_s = 0.1;
    sample_.temperature_degc = 25;
    sample_.uhfo_v = 5.25;
  }

  Lines play(const std::string& command, std::istream& words) {
    given_.clear();
    if (command == "engine") {  // with these settings
      settings_ = {};
      for (std::string word; words >> word;) {
        if (word == "any_temperature") settings_ = test::believing(settings_);
        if (word == "max_bias") words >> settings_.max_bias_deg_per_h;
        if (word == "stuck") words >> settings_.plausibility.temperature.stuck_s;
        if (word == "slew") settings_.slew = {true, next<double>(words)};
        if (word == "no_slew") settings_.slew = {false, {}};
      }
      engine_ = CompensationEngine(settings_, list_);
    } else if (command == "use") {
      const ModelPtr model = model_of(words), fallback = model_of(words);
      const auto used = engine_.use(model, fallback);
      given_.push_back((used ? "in force:" : used.error().text() + ":") +
                       (" " + shown(engine_.correction(), kUnknown)));
    } else if (command == "T") {
      sample_.temperature_degc = number_of(next<std::string>(words));
    } else if (command == "U") {
      sample_.uhfo_v = number_of(next<std::string>(words));
    } else if (command == "case") {
      case_degc_ = number_of(next<std::string>(words));
    } else if (command == "offset") {
      engine_.set_offset(number_of(next<std::string>(words)));
    } else if (command == "rate") {
      sample_.rate_deg_per_h = number_of(next<std::string>(words));
    } else if (command == "s") {
      push(10 * next<int>(words), 0);
    } else if (command == "n") {
      push(next<int>(words), 0);
    } else if (command == "warm") {  // seconds, of a T that rises by N degC/s, without output
      const int seconds = next<int>(words);
      push(10 * seconds, next<double>(words) / 10);
      given_.clear();
    } else if (command == "skip") {
      time_ns_ += std::llround(1e9 * next<double>(words));
    } else if (command == "finish") {
      const auto row = engine_.finish();
      given_.push_back(row ? fmt::format("row {}: {}", row->window.second_mean.second, shown(*row)) : "no row");
    } else if (command == "reset") {
      engine_.reset();
    } else if (command == "follow") {  // windows of SECOND T [WARM_S]
      Window window;
      words >> window.second_mean.second;
      window.temperature_degc = number_of(next<std::string>(words));
      window.warm_s = next<int>(words, history_s(short_features()));
      given_.push_back(shown(engine_.follow(window), kUnknown));
    } else if (command == "break_off") {
      engine_.break_off();
    } else {
      given_.push_back("unknown command");
    }
    return given_;
  }

 private:
  void push(int samples, double step_degc) {
    Lines rows;
    std::string before, before_row;
    int count = 0;
    std::int64_t first = 0, last = 0;
    const auto end = [&] {
      if (count > 0) given_.push_back(fmt::format("{} x {}", count, before));
      count = 0;
    };
    const auto end_row = [&] {
      if (before_row.empty()) return;
      rows.push_back(fmt::format("row{} {}: {}", first < last ? "s" : "",
                                 first < last ? fmt::format("{} to {}", first, last) : std::to_string(first),
                                 before_row));
    };
    for (int i = 0; i < samples; ++i) {
      sample_.temperature_degc += step_degc;
      sample_.time_ns = time_ns_ += 100'000'000;
      Compensated out;
      const auto row = engine_.push(sample_, out, {&case_degc_, 1});
      EXPECT_EQ(out.sample.time_ns, time_ns_);
      std::string text = shown(out.correction, out.corrected_deg_per_h);
      if (out.correction.quality & kImplausible) text += shown("T", out.sample.temperature_degc);
      if (text != before) end();
      before = text;
      ++count;
      if (!row) continue;
      const std::string of_row = shown(*row);
      if (of_row != before_row) end_row(), first = row->window.second_mean.second;
      last = row->window.second_mean.second;
      before_row = of_row;
    }
    end();
    end_row();
    given_.insert(given_.end(), rows.begin(), rows.end());
  }
  CompensationSettings settings_;
  const SensorList list_ = std::make_shared<const std::vector<SensorName>>(std::vector<SensorName>{{"case", "degC"}});
  CompensationEngine engine_{{}, list_};
  Sample sample_;
  double case_degc_ = kUnknown;
  std::int64_t time_ns_ = 0;
  Lines given_;
};

TEST(CompensationEngine, Scripts) { test::expect_scripts<EnginePlayer>("compensation/engine.txt"); }

/// A check of a temperature. "every 0.1 20*11 100": values, 0.1 s apart, of which the first is one period later.
class SensorPlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    Lines given;
    if (command == "stuck") {
      SensorLimits limits = PlausibilityLimits().temperature;
      words >> limits.stuck_s;
      sensor_ = SensorCheck(limits);
      return given;
    }
    const auto period_s = next<double>(words);
    for (std::string word; words >> word;) {
      const auto star = word.find('*'), slope = word.find('/');
      const int times = star == std::string::npos ? 1 : std::stoi(word.substr(star + 1));
      int rejected = 0, first = 0, last = 0;
      for (int i = 1; i <= times; ++i) {
        time_s_ += period_s;
        const double value = std::stod(word) + (slope == std::string::npos ? 0 : std::stod(word.substr(slope + 1)) * i);
        if (sensor_.check(value, std::llround(1e9 * time_s_))) continue;
        if (rejected++ == 0) first = i;
        last = i;
      }
      if (rejected > 0)
        given.push_back(fmt::format("{}: {} rejected, from {} to {}: {}", word, rejected, first, last,
                                    rejection_text(sensor_.rejection(), "degC")));
    }
    if (given.empty()) given.push_back("good");
    return given;
  }

 private:
  SensorCheck sensor_{PlausibilityLimits().temperature};
  double time_s_ = 0;
};

TEST(SensorCheck, Scripts) { test::expect_scripts<SensorPlayer>("compensation/sensor_checks.txt"); }

// A random sequence of gaps, clock steps, failed sensors, new models and ends of sessions. A corrected rate is always
// the rate minus the bias in its row, with a quality that allows a correction.
TEST(CompensationEngine, NeverPublishesASilentlyUncorrectedRate) {
  std::mt19937_64 random(7);
  const auto chance = [&](int one_in) { return random() % static_cast<unsigned>(one_in) == 0; };
  const auto check = [](double rate, const Correction& correction, double corrected) {
    const bool biased = std::isfinite(correction.bias_deg_per_h);
    EXPECT_EQ(std::isfinite(corrected), biased && std::isfinite(rate));
    EXPECT_TRUE(!std::isfinite(corrected) || corrected == rate - correction.bias_deg_per_h);
    const bool has_reason = (correction.quality & (kWarming | kNoModel | kInputMissing | kOverLimit)) != 0;
    const bool by_fallback = (correction.quality & (kNoModel | kInputMissing | kOverLimit | kFallback)) == kFallback;
    EXPECT_TRUE(biased ? !has_reason || by_fallback : has_reason) << quality_text(correction.quality);
    EXPECT_EQ((correction.quality & kRateInvalid) != 0, !std::isfinite(rate));
  };
  const auto model = [](const char* text) {
    std::istringstream words(text);
    return model_of(words);
  };
  const ModelPtr both = model("T:0.01 U:0.1"), voltage = linear_model({"U"}, {0.1});
  CompensationEngine engine(test::believing());
  Sample sample;
  sample.rate_deg_per_h = 8, sample.interval_s = 0.1, sample.temperature_degc = 25, sample.uhfo_v = 5.25;
  ASSERT_TRUE(engine.use(model("T:0.01"), nullptr));
  int corrected_rows = 0;
  for (int i = 0; i < 200'000 && !testing::Test::HasFailure(); ++i) {
    if (chance(3000)) sample.time_ns += (static_cast<int>(random() % 8) - 1) * kNanosecondsPerSecond;
    if (chance(4000)) sample.temperature_degc = chance(2) ? kUnknown : 25 + 0.001 * static_cast<double>(random() % 100);
    if (chance(4000)) sample.uhfo_v = chance(2) ? kUnknown : 5.2;
    if (chance(2000)) sample.rate_deg_per_h = chance(2) ? kUnknown : 8;
    if (chance(9000)) {
      EXPECT_TRUE(engine.use(both, nullptr));
    }
    if (chance(9000)) {
      EXPECT_TRUE(engine.use(model(chance(4) ? "T:5" : "T:0.02"), voltage));
    }
    if (chance(30000)) engine.reset();
    if (chance(30000)) engine.finish();
    sample.time_ns += 100'000'000;
    Compensated out;
    if (const auto row = engine.push(sample, out))
      check(row->window.second_mean.rate_deg_per_h, row->correction, row->corrected_deg_per_h);
    check(out.sample.rate_deg_per_h, out.correction, out.corrected_deg_per_h);
    if (std::isfinite(out.corrected_deg_per_h)) ++corrected_rows;
  }
  EXPECT_GT(corrected_rows, 10'000);  // the test is valid only if many rows were corrected
}

}  // namespace
}  // namespace prism::compensation
