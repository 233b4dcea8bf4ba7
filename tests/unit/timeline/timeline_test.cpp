// SPDX-License-Identifier: MIT
// The rules of docs/frames.md, from the truth: every damage, with every source of time and every kind of gyro value.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "tests/unit/timeline/truth.hpp"

namespace prism {
namespace {

using test::Damage;
using test::TimeSource;

struct Case {
  TimeSource source;
  const char* meaning;
  Damage damage;
  std::uint64_t first_counter;
};

constexpr const char* kDamageNames[] = {"None",         "Wrap",         "Reset",        "Reboot",
                                        "WrongCounter", "CounterShift", "ShortGap",     "LongGap",
                                        "GapOverWrap",  "Suspended",    "ClockForward", "ClockBack",
                                        "Batches",      "Duplicate",    "Swap",         "SeveralTypes"};
constexpr const char* kSourceNames[] = {"Host", "Device", "RawBytes"};

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const TimeSource source : {TimeSource::kHost, TimeSource::kDevice, TimeSource::kRawBytes}) {
    for (const char* meaning : {"rate", "increment", "accumulated"}) {
      for (int damage = 0; damage < test::kDamages; ++damage) {
        for (const std::uint64_t first : {1'000U, 61'000U})
          cases.push_back({source, meaning, static_cast<Damage>(damage), first});
      }
    }
  }
  return cases;
}

std::string name_of(const testing::TestParamInfo<Case>& info) {
  const Case& c = info.param;
  return std::string(kSourceNames[static_cast<int>(c.source)]) + "_" + c.meaning + "_" +
         kDamageNames[static_cast<int>(c.damage)] + (c.first_counter == 1'000 ? "" : "_Wraps");
}

/// Seconds that may lack a rate because of the damage; 0: all 58 full seconds of a minute have one.
int allowed_loss(const Case& c) {
  switch (c.damage) {
    case Damage::kReset:
    case Damage::kReboot:
    case Damage::kCounterShift:
      return 3;  // a session may begin: a partial second at each side of it
    case Damage::kLongGap:
    case Damage::kGapOverWrap:
    case Damage::kSuspended:
    case Damage::kClockForward:
    case Damage::kClockBack:
      return 4;  // the disagreement shows after a second
    default:
      return 0;
  }
}

struct PublishedSecond {
  compensation::SecondMean mean;
  double last_t_s = 0;  ///< true time of its last sample
  std::int64_t last_ns = 0;
};

/// Complete seconds, in the order of publication. A session and a second before the last one begin a new average, as in
/// the pipeline.
std::vector<PublishedSecond> seconds_of(const std::vector<test::TimedSample>& samples) {
  std::vector<PublishedSecond> seconds;
  compensation::SecondAverager averager;
  PublishedSecond open;
  int session = 0;
  std::int64_t last_second = 0;
  const auto publish = [&](const std::optional<compensation::SecondMean>& mean) {
    if (!mean) return;
    open.mean = *mean;
    if (!mean->partial) seconds.push_back(open);
  };
  for (const test::TimedSample& s : samples) {
    const std::int64_t second = compensation::second_number(s.sample.time_ns);
    if (s.session != session || second < last_second) publish(averager.finish());
    session = s.session;
    last_second = second;
    publish(averager.push(s.sample));
    open.last_t_s = s.t_s;
    open.last_ns = s.sample.time_ns;
  }
  publish(averager.finish());
  return seconds;
}

class Timelines : public testing::TestWithParam<Case> {};

// One pulse in the second, and the change of the rate (0.5 deg/h a second) over the second and a lost interval.
double tolerance_of(std::uint32_t samples) { return 0.1 / (samples / test::kRate_hz) + 0.25 + 0.5; }

TEST_P(Timelines, PublishTheTrueRateAndLoseNoSecond) {
  const Case& c = GetParam();
  const auto description = test::timeline_description(c.meaning);
  const auto frames = test::true_frames(*description, c.source, c.damage, 60, c.first_counter);
  test::Timeline timeline(description, c.source);
  const auto seconds = seconds_of(timeline.run(frames));
  int known = 0;
  for (const PublishedSecond& second : seconds) {
    if (std::isnan(second.mean.rate_deg_per_h)) continue;
    ++known;
    EXPECT_NEAR(second.mean.rate_deg_per_h, test::true_rate(second.last_t_s), tolerance_of(second.mean.samples))
        << "second that ends at " << second.last_t_s << " s with " << second.mean.samples << " samples";
  }
  EXPECT_GE(known, 58 - allowed_loss(c));
}

// The time of a sample is its arrival, or device time since the first arrival of its session.
TEST_P(Timelines, KeepTheTime) {
  const Case& c = GetParam();
  const auto description = test::timeline_description(c.meaning);
  const auto frames = test::true_frames(*description, c.source, c.damage, 60, c.first_counter);
  test::Timeline timeline(description, c.source);
  const auto samples = timeline.run(frames);
  ASSERT_FALSE(samples.empty());
  if (c.source == TimeSource::kRawBytes) return;
  const auto& last = frames.back();
  const double true_end = 1e-9 * static_cast<double>(last.reading.arrival_ns);
  const bool set = c.damage == Damage::kClockForward || c.damage == Damage::kClockBack;
  EXPECT_NEAR(1e-9 * static_cast<double>(samples.back().sample.time_ns), true_end,
              set && c.source == TimeSource::kDevice ? 1.1 : 0.1);
}

INSTANTIATE_TEST_SUITE_P(All, Timelines, testing::ValuesIn(all_cases()), name_of);

}  // namespace
}  // namespace prism
