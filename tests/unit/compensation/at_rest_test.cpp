// SPDX-License-Identifier: MIT
// The difference from the Earth rate: its mean and variance by hand, when it is unknown, and how often it is beyond 3
// sd.
#include "compensation/at_rest.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "compensation/polynomial_model.hpp"
#include "tests/support/random_series.hpp"
#include "tests/support/scripts.hpp"

namespace prism::compensation {
namespace {

constexpr double kSecondSd = 0.064, kN = kSecondSd / 60, kSd = 0.01, kMount = 1e-3;
const AxisPlacement kUp;  // at 34.25 deg north

ModelPtr model_with(std::optional<RateNoise> noise, std::optional<BetweenRunError> spread = {}) {
  ModelInfo info;
  info.kind = "polynomial";
  info.inputs = {"T"};
  info.noise = noise;
  info.spread = spread;
  return std::make_shared<PolynomialModel>(std::move(info), std::vector<Term>{{{1}, 0}}, kSd);
}
ModelPtr usual_model() { return model_with(RateNoise{kN, 0.001, kSecondSd}); }

/// Seconds of a gyro whose corrected rate is the Earth rate + error + noise + motion(second).
class Gyro {
 public:
  Gyro(AtRest& rest, std::uint64_t seed) : rest_(rest), normal_(seed) {}

  void run(
      int seconds, double error_deg_per_h, const std::function<double(int)>& motion = [](int) { return 0.0; },
      std::uint32_t quality = kGood) {
    for (int i = 0; i < seconds; ++i) {
      CompensatedWindow row;
      row.window.second_mean.second = second_;
      row.window.state = WindowState::kReady;
      row.corrected_deg_per_h =
          earth_rate_deg_per_h(kUp) + error_deg_per_h + kSecondSd * normal_() + motion(static_cast<int>(second_));
      rates_.push_back(row.corrected_deg_per_h);
      if (rates_.size() > 100) rates_.pop_front();
      double sum = 0;
      for (const double rate : rates_) sum += rate;
      row.corrected_mean_deg_per_h = sum / static_cast<double>(rates_.size());
      row.correction = {0, kSd, kSd, quality};
      ++second_;
      beyond = (rest_.push(row) && rest_.differs() == true) || beyond;
    }
  }
  bool beyond = false;  ///< a problem began

 private:
  AtRest& rest_;
  test::Normal normal_;
  std::deque<double> rates_;
  std::int64_t second_ = 1'767'225'600;
};

TEST(AtRest, TheVarianceIsOfModelNoiseAndMount) {
  AtRest rest(kUp, kMount, usual_model());
  Gyro(rest, 1).run(3600, 0.5);
  EXPECT_EQ(rest.differs(), true);
  const auto found = *rest.difference();
  EXPECT_EQ(found.seen_s, AtRest::kSeenS);
  EXPECT_NEAR(found.deg_per_h, 0.5, 4 * kN * std::sqrt(2));
  const double mount = kMount * 15.041067 * std::cos(34.25 * std::numbers::pi / 180);
  EXPECT_NEAR(mount, 0.0124, 5e-5);
  EXPECT_NEAR(found.sd_deg_per_h, std::sqrt(kSd * kSd + 2 * kN * kN + 0.4412712 * 1e-6 + mount * mount), 1e-8);
}

TEST(AtRest, LimitsAreThoseOfTheNoise) {
  const RestLimits limits = rest_limits({0.5, 2, 3}, 100);
  EXPECT_EQ(limits.second_sd_deg_per_h, 4.5);
  EXPECT_NEAR(limits.step_deg_per_h, 4 * std::sqrt(2 * (0.25 * 36 + 0.4412712 * 4)), 1e-6);
  EXPECT_NEAR(limits.difference_deg_per_h, 30.082134, 1e-9);
  ModelInfo info;
  EXPECT_FALSE(noise_of(info));
  info.spread.emplace();
  EXPECT_FALSE(noise_of(info)) << "of a model that states no noise";
  info.spread->noise_deg_per_h = 3;  // of 100 s: 30 of a second, and 30 / 60 of an hour
  EXPECT_EQ(noise_of(info), (RateNoise{0.5, 0, 30}));
  info.noise = RateNoise{1, 2, 3};
  EXPECT_EQ(noise_of(info), info.noise);
}

/// Blocks of 100 s of a gyro that points up, with the noise N 0.01, B 0.02 and an sd of 0.5 of seconds, and a model
/// with an sd of 0.1. run SECONDS DIFFERENCE [SWING]: from the Earth rate, by SWING more and less each second.
class RestPlayer {
 public:
  std::vector<std::string> play(const std::string& command, std::istream& words) {
    using test::next;
    if (command == "skip") {
      second_ += next<int>(words);
    } else if (command == "reset") {
      rest_.reset();
    } else if (command == "quality") {
      quality_ = parse_quality(next<std::string>(words));
    } else if (command == "sd") {
      sd_ = next<double>(words);
      if (sd_ < 0) sd_ = kUnknown;
    } else if (command == "warming") {
      state_ = WindowState::kWarming;
    } else if (command == "ready") {
      state_ = WindowState::kReady;
    } else if (command == "run") {
      const int seconds = next<int>(words);
      const double difference = next<double>(words), swing = next<double>(words);
      int ended = 0;
      for (int i = 0; i < seconds; ++i, ++second_) {
        CompensatedWindow row;
        row.window.second_mean.second = second_;
        row.window.state = state_;
        row.corrected_mean_deg_per_h = rest_.earth_rate_deg_per_h() + difference;
        row.corrected_deg_per_h = row.corrected_mean_deg_per_h + (i % 2 ? -swing : swing);
        row.correction = {0, sd_, sd_, quality_};
        ended += rest_.push(row);
      }
      const auto found = rest_.difference();
      const auto differs = rest_.differs();
      return {fmt::format(
          "{} blocks, {}{}{}", ended, kNoDifferenceNames[static_cast<std::size_t>(rest_.reason())],
          found ? fmt::format("{:.6g} with sd {:.6g} of {} s", found->deg_per_h, found->sd_deg_per_h, found->seen_s)
                : "",
          differs ? *differs ? ", differs" : ", as expected" : "")};
    } else {
      return {"unknown command"};
    }
    return {};
  }

 private:
  AtRest rest_{kUp, 0, [] {
                 ModelInfo info;
                 info.kind = "polynomial";
                 info.inputs = {"T"};
                 info.noise = RateNoise{0.01, 0.02, 0.5};
                 return std::make_shared<PolynomialModel>(std::move(info), std::vector<Term>{{{1}, 0}}, kSd);
               }()};
  std::int64_t second_ = 1000;
  std::uint32_t quality_ = kGood;
  WindowState state_ = WindowState::kReady;
  double sd_ = 0.1;
};

TEST(AtRest, Scripts) { test::expect_scripts<RestPlayer>("compensation/at_rest.txt"); }

TEST(AtRest, AnUnknownDifferenceHasAReason) {
  EXPECT_EQ(AtRest(std::nullopt, kMount, usual_model()).reason(), NoDifference::kNoSite);
  EXPECT_EQ(AtRest(kUp, kMount, nullptr).reason(), NoDifference::kNoNoise);
  EXPECT_EQ(AtRest(kUp, kMount, model_with({})).reason(), NoDifference::kNoNoise);
  EXPECT_EQ(AtRest(kUp, kMount, model_with({}, BetweenRunError{0, 0, 0.0064})).reason(), NoDifference::kTooLittle);
  AtRest rest(kUp, kMount, usual_model());
  Gyro gyro(rest, 2);
  gyro.run(
      50, 0, [](int) { return 0.0; }, kWarming);
  EXPECT_EQ(rest.reason(), NoDifference::kQuality);
  gyro.run(499, 0);
  EXPECT_EQ(rest.reason(), NoDifference::kTooLittle);
  gyro.run(1, 0);
  EXPECT_EQ(rest.reason(), NoDifference::kNone);
  EXPECT_FALSE(rest.differs());
  rest.reset();
  EXPECT_EQ(rest.reason(), NoDifference::kTooLittle);
  EXPECT_FALSE(rest.difference());
}

TEST(AtRest, AGyroThatSwingsTurnsOrIsMovedIsNotAtRest) {
  const std::function<double(int)> motions[] = {
      [](int s) { return 0.2 * std::sin(s * 2.1); }, [](int s) { return 0.2 * std::sin(s / 50.0); },
      [](int s) { return s % 90 == 0 ? 3600.0 : 0.0; }, [](int) { return 40.0; }};
  for (const auto& motion : motions) {
    AtRest rest(kUp, kMount, usual_model());
    Gyro gyro(rest, 3);
    gyro.run(7200, 0, motion);
    EXPECT_FALSE(gyro.beyond);
    EXPECT_FALSE(rest.differs());
    EXPECT_EQ(rest.reason(), NoDifference::kMoving);
  }
}

TEST(AtRest, AfterAMoveOnlyTheNewDirectionCounts) {
  AtRest rest(kUp, kMount, usual_model());
  Gyro gyro(rest, 4);
  gyro.run(3600, 0);
  gyro.run(600, -3);  // on its side
  EXPECT_NEAR(rest.difference()->deg_per_h, -3, 0.05);
  EXPECT_FALSE(gyro.beyond);
  gyro.run(1700, -3);
  EXPECT_TRUE(gyro.beyond);
  gyro.run(600, 0);
  EXPECT_EQ(rest.differs(), std::nullopt);
  gyro.run(1400, 0);
  EXPECT_EQ(rest.differs(), false);
}

// The short form of `tools/bench science` (rest): errors as stated, and off by 0.1 deg/h.
TEST(AtRest, GoodModelsRaiseNoProblemAndMovedBiasesDo) {
  constexpr int kRuns = 300;
  const double mount = kMount * 15.041067 * std::cos(34.25 * std::numbers::pi / 180);
  test::Normal normal(5);
  int alarms = 0, found = 0;
  for (int run = 0; run < kRuns; ++run) {
    const double error = kSd * normal() + mount * normal();
    for (const double moved : {0.0, run % 2 ? 0.1 : -0.1}) {
      AtRest rest(kUp, kMount, usual_model());
      Gyro gyro(rest, static_cast<std::uint64_t>(run + 10));
      gyro.run(3600, error + moved);
      (moved == 0 ? alarms : found) += gyro.beyond;
    }
  }
  EXPECT_LE(alarms, kRuns / 100);
  EXPECT_GE(found, kRuns * 95 / 100);
}

}  // namespace
}  // namespace prism::compensation
