// SPDX-License-Identifier: MIT
// The rules of docs/frames.md, from the truth: every damage, with every source of time and every kind of gyro value.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "compensation/second_averager.hpp"
#include "drivers/clock.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism {
namespace {

/// An event in the middle of a minute.
struct Damage {
  const char* name;
  double lost_s = 0;     ///< frames that are lost
  int loses_a_rate = 0;  ///< seconds that may lack a rate; 0: all 58 full seconds of a minute have one
  bool counter_at_0 = false, angle_at_0 = false;
  std::uint64_t counter_shift = 0;  ///< from then on
  double host_s = 0;                ///< the host clock is set, unnoticed
  bool is(const char* other) const { return std::string_view(name) == other; }
};

/// A session may begin: a partial second at each side of it. A disagreement shows after a second.
constexpr int kSession = 3, kDisagreement = 4;
constexpr Damage kDamages[] = {
    {"None"},
    {.name = "Reset", .loses_a_rate = kSession, .counter_at_0 = true},  // without a pause
    {.name = "Reboot", .lost_s = 2.3, .loses_a_rate = kSession, .counter_at_0 = true, .angle_at_0 = true},
    {"WrongCounter"},  // one frame has a counter that is too high
    {.name = "CounterShift", .loses_a_rate = kSession, .counter_shift = 34'000},
    {"ShortGap", 0.4},
    {"LongGap", 20, kDisagreement},
    {"GapOverWrap", 400, kDisagreement},    // the counter wraps unseen
    {"Suspended", 108'000, kDisagreement},  // the angle wraps unseen, too
    {.name = "ClockForward", .loses_a_rate = kDisagreement, .host_s = 3600},
    {.name = "ClockBack", .loses_a_rate = kDisagreement, .host_s = -3600},
    {"Batches"},      // frames arrive in batches of 16
    {"Duplicate"},    // a frame comes twice
    {"Swap"},         // two frames change places
    {"SeveralTypes"}  // frames without gyro data in between
};

enum class TimeSource { kHost, kDevice, kRawBytes };

constexpr double kRate_hz = 200, kBegin_s = 1.0e9;

/// True rate, deg/h: it changes, so that a mean over another time is another value.
double true_rate(double t_s) { return 17'000 + 0.5 * t_s; }
/// Its integral since t = 0, arcsec.
double true_angle(double t_s) { return 17'000 * t_s + 0.25 * t_s * t_s; }

struct TrueFrame {
  wire::DecodedMessage reading;
  double t_s = 0;  ///< end of its interval, device time
};

/// trplg (16-bit counter at 200 Hz); `meaning`: "rate", "increment" or "accumulated" (32 bits of 0.1 arcsec).
wire::FrameDescriptionPtr timeline_description(const std::string& meaning, double rate_hz = kRate_hz) {
  std::string text =
      test::read_file(test::frames_dir() / (meaning == "increment" ? "trplg-increment.json" : "trplg.json"));
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("\"rate_hz\": 200", "\"rate_hz\": " + std::to_string(rate_hz));
  if (meaning == "rate") {
    replace(R"("type": "u32", "unit": "pulse")", R"("type": "u32", "unit": "deg/h")");
    replace(R"("meaning": "accumulated", "unit": "pulse", "arcsec_per_pulse": 0.1,)",
            R"("meaning": "rate", "unit": "deg/h",)");
  }
  return test::description_of(text);
}

/// Frames of `length_s` with `damage` in the middle. `first_counter`: of the first frame.
std::vector<TrueFrame> true_frames(const wire::FrameDescription& description, TimeSource source, const Damage& damage,
                                   double length_s, std::uint64_t first_counter) {
  const bool accumulated = description.gyro.meaning == wire::RateEncoding::kAccumulated;
  const bool is_rate = description.gyro.meaning == wire::RateEncoding::kRate;
  const double scale = description.axes[0].scale, middle_s = length_s / 2;
  std::vector<TrueFrame> frames;
  double angle_zero = 0;
  std::uint64_t counter_zero = 0;
  double host_offset_s = 0;
  bool happened = false;
  std::uint64_t bytes = 0;
  const auto count = static_cast<std::int64_t>((length_s + damage.lost_s) * kRate_hz);
  for (std::int64_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i + 1) / kRate_hz;
    if (t > middle_s && t <= middle_s + damage.lost_s) continue;
    if (!happened && t > middle_s + damage.lost_s) {
      happened = true;
      if (damage.counter_at_0) counter_zero = static_cast<std::uint64_t>(i) + first_counter;
      if (damage.angle_at_0) angle_zero = true_angle(t);
      counter_zero -= damage.counter_shift;
      host_offset_s = damage.host_s;
    }
    TrueFrame frame;
    frame.t_s = t;
    wire::DecodedMessage& r = frame.reading;
    r.length = description.max_frame_bytes;
    r.offset = bytes;
    bytes += r.length;
    r.has_gyro = r.has_counter = r.gyro[0].carried = r.gyro[0].valid = true;
    std::uint64_t counter = first_counter + static_cast<std::uint64_t>(i) - counter_zero;
    if (damage.is("WrongCounter") && i == static_cast<std::int64_t>(middle_s * kRate_hz)) counter += 34'000;
    r.counter = counter % 65536;
    const double pulses = std::floor((true_angle(t) - angle_zero) / scale);
    r.gyro[0].value = is_rate ? true_rate(t - 0.5 / kRate_hz) / scale
                      : accumulated
                          ? std::fmod(pulses, 4294967296.0)
                          : std::floor(true_angle(t) / scale) - std::floor(true_angle(t - 1 / kRate_hz) / scale);
    const double arrived = damage.is("Batches") ? std::ceil(static_cast<double>(i + 1) / 16) * 16 / kRate_hz : t;
    const double wire_s = 1e-9 * description.wire.byte_time_ns() * r.length;
    r.behind = damage.is("Batches") ? static_cast<std::uint32_t>((15 - i % 16) * r.length) : 0;
    const double backlog_s = 1e-9 * description.wire.byte_time_ns() * r.behind;
    // raw bytes have a pace of their own: twice too slow, as in a stream of several lengths
    const double host_s = source == TimeSource::kRawBytes ? 2 * static_cast<double>(r.offset) / (r.length * kRate_hz)
                                                          : kBegin_s + arrived + host_offset_s;
    r.arrival_ns = std::llround(1e9 * (host_s + wire_s - (source == TimeSource::kRawBytes ? 0 : backlog_s)));
    r.temperature_degc = 25;
    if (damage.is("SeveralTypes") && i % 3 == 0) {
      TrueFrame other = frame;
      other.reading.has_gyro = other.reading.has_counter = false;
      frames.push_back(other);
    }
    frames.push_back(frame);
    if (damage.is("Duplicate") && happened && i == static_cast<std::int64_t>(middle_s * kRate_hz) + 5)
      frames.push_back(frame);
    const std::size_t n = frames.size();
    if (damage.is("Swap") && i == static_cast<std::int64_t>(middle_s * kRate_hz) + 5)
      std::swap(frames[n - 1], frames[n - 2]);
  }
  return frames;
}

struct TimedSample {
  Sample sample;
  int session = 0;
  double t_s = 0;  ///< true
};

/// Counter check and clock, as in the pipeline.
class Timeline {
 public:
  Timeline(const wire::FrameDescriptionPtr& description, TimeSource source)
      : clock_(description,
               {.source = source == TimeSource::kHost ? drivers::ClockSource::kHost : drivers::ClockSource::kDevice,
                .arrivals_are_measured = source != TimeSource::kRawBytes}) {}

  std::vector<TimedSample> run(const std::vector<TrueFrame>& frames) {
    std::vector<TimedSample> samples;
    int session = 0;
    std::vector<TrueFrame> recent;
    for (const TrueFrame& frame : frames) {
      recent.push_back(frame);
      clock_.check_counter(frame.reading, [&](const wire::DecodedMessage& reading) {
        const bool measured = clock_.push(reading);
        session += clock_.began_session();
        if (!measured) return;
        const auto sample = clock_.sample(reading, 0);
        if (!sample) return;
        const auto truth = std::find_if(recent.rbegin(), recent.rend(),
                                        [&](const TrueFrame& f) { return f.reading.offset == reading.offset; });
        samples.push_back({*sample, session, truth->t_s});
      });
    }
    return samples;
  }

 private:
  drivers::Clock clock_;
};

struct Case {
  TimeSource source;
  const char* meaning;
  Damage damage;
  std::uint64_t first_counter;
};

constexpr const char* kSourceNames[] = {"Host", "Device", "RawBytes"};

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const TimeSource source : {TimeSource::kHost, TimeSource::kDevice, TimeSource::kRawBytes}) {
    for (const char* meaning : {"rate", "increment", "accumulated"}) {
      for (const Damage& damage : kDamages) {
        for (const std::uint64_t first : {1'000U, 61'000U}) cases.push_back({source, meaning, damage, first});
      }
    }
  }
  return cases;
}

std::string name_of(const testing::TestParamInfo<Case>& info) {
  const Case& c = info.param;
  return std::string(kSourceNames[static_cast<int>(c.source)]) + "_" + c.meaning + "_" + c.damage.name +
         (c.first_counter == 1'000 ? "" : "_Wraps");
}

struct PublishedSecond {
  compensation::SecondMean mean;
  double last_t_s = 0;  ///< true time of its last sample
};

/// Complete seconds, in the order of publication. A session and a second before the last one begin a new average, as in
/// the pipeline.
std::vector<PublishedSecond> seconds_of(const std::vector<TimedSample>& samples) {
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
  for (const TimedSample& s : samples) {
    const std::int64_t second = compensation::second_number(s.sample.time_ns);
    if (s.session != session || second < last_second) publish(averager.finish());
    session = s.session;
    last_second = second;
    publish(averager.push(s.sample));
    open.last_t_s = s.t_s;
  }
  publish(averager.finish());
  return seconds;
}

class Timelines : public testing::TestWithParam<Case> {};

// One pulse in the second, and the change of the rate (0.5 deg/h a second) over the second and a lost interval.
double tolerance_of(std::uint32_t samples) { return 0.1 / (samples / kRate_hz) + 0.25 + 0.5; }

// The time of a sample is its arrival, or device time since the first arrival of its session.
TEST_P(Timelines, PublishTheTrueRateLoseNoSecondAndKeepTheTime) {
  const Case& c = GetParam();
  const auto description = timeline_description(c.meaning);
  const auto frames = true_frames(*description, c.source, c.damage, 60, c.first_counter);
  Timeline timeline(description, c.source);
  const auto samples = timeline.run(frames);
  ASSERT_FALSE(samples.empty());
  int known = 0;
  for (const PublishedSecond& second : seconds_of(samples)) {
    if (std::isnan(second.mean.rate_deg_per_h)) continue;
    ++known;
    EXPECT_NEAR(second.mean.rate_deg_per_h, true_rate(second.last_t_s), tolerance_of(second.mean.samples))
        << "second that ends at " << second.last_t_s << " s with " << second.mean.samples << " samples";
  }
  EXPECT_GE(known, 58 - c.damage.loses_a_rate);
  if (c.source == TimeSource::kRawBytes) return;
  const double true_end_s = 1e-9 * static_cast<double>(frames.back().reading.arrival_ns);
  EXPECT_NEAR(1e-9 * static_cast<double>(samples.back().sample.time_ns), true_end_s,
              c.damage.host_s != 0 && c.source == TimeSource::kDevice ? 1.1 : 0.1);
}

INSTANTIATE_TEST_SUITE_P(All, Timelines, testing::ValuesIn(all_cases()), name_of);

constexpr std::uint64_t kModulus = 65536;
constexpr double kSlowHz = 10;

struct Expected {
  double time_s = 0;  ///< since the first frame's measurement
  double rate_deg_per_h = 0, interval_s = 0;
  int session = 0;
};

std::uint64_t ahead(std::uint64_t from, std::uint64_t to) { return (to + kModulus - from) % kModulus; }

/// Rule "wrong counter": at most 4 frames ahead, or confirmed by the next frame.
std::vector<wire::DecodedMessage> plausible_frames(const std::vector<wire::DecodedMessage>& all) {
  std::vector<wire::DecodedMessage> kept;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool near = kept.empty() || ahead(kept.back().counter, all[i].counter) <= 4;
    if (!near && i + 1 == all.size()) break;  // waits for the next frame
    if (near || ahead(kept.back().counter, all[i].counter) <= ahead(kept.back().counter, all[i + 1].counter))
      kept.push_back(all[i]);
  }
  return kept;
}

enum class Verdict { kAgree, kDisagree, kUncertain };

/// Rules "counter jumps ahead of the arrivals" and "arrivals are late", over all frames of the session so far.
class Agreement {
 public:
  Verdict of(double x, double y, bool waited) {
    const auto [ax, ay] = anchors_.size() > 1 ? anchors_[anchors_.size() - 2] : anchors_.front();
    const auto [lx, ly] = frames_.back();
    const double rate = window_rate();
    double fastest = std::max(1.0, rate);
    if (ly - ay >= 1) fastest = std::max(fastest, (lx - ax) / (ly - ay));
    if (ly >= 1 && x - ax > fastest * (1.2 * (y - ay) + 1)) return Verdict::kDisagree;
    if (gap_) {
      const auto [gx, gy] = *gap_;
      if (x - gx <= 2 * (y - gy) + 0.1) return y - gy > 0.2 ? Verdict::kDisagree : Verdict::kUncertain;
      gap_.reset();
    }
    const bool late = std::abs(rate - 1) < 0.05 && (y - ay) - (x - ax) / rate > 1;
    const bool begins = late && (late_.empty() || late_.back() < 0);
    late_.push_back(late ? y : -1);
    if (begins && !waited && y - ly > 10) {
      gap_ = {x, y};
      return Verdict::kUncertain;
    }
    if (late) {
      auto first = late_.rbegin();
      while (first + 1 != late_.rend() && *(first + 1) >= 0) ++first;
      if (y - *first > 1) return Verdict::kDisagree;
    }
    frames_.push_back({x, y});
    if (!late && y - anchors_.back().second >= 10) anchors_.push_back({x, y});
    return Verdict::kAgree;
  }

 private:
  double window_rate() const {
    if (anchors_.size() < 2) return 0;
    const auto [x0, y0] = anchors_[anchors_.size() - 2];
    const auto [x1, y1] = anchors_.back();
    return (x1 - x0) / (y1 - y0);
  }
  std::vector<std::pair<double, double>> frames_{{0, 0}}, anchors_{{0, 0}};
  std::vector<double> late_;
  std::optional<std::pair<double, double>> gap_;  ///< first frame after a long gap, as long as it is uncertain
};

std::vector<Expected> reference(const wire::FrameDescription& description, const std::vector<wire::DecodedMessage>& all,
                                bool measured) {
  const bool accumulated = description.gyro.meaning == wire::RateEncoding::kAccumulated;
  const double scale = description.axes[0].scale, wrap = description.axes[0].wrap;
  const auto measured_ns = [&](const wire::DecodedMessage& r) {
    return r.arrival_ns - std::llround(description.wire.byte_time_ns() * r.length);
  };
  std::vector<Expected> expected;
  std::optional<wire::DecodedMessage> last;
  std::int64_t first_ns = 0, origin_ns = 0;
  double ticks = 0, angle_s = 0, last_y = 0;
  std::optional<double> angle;
  Agreement agreement;
  int session = 0;
  for (const wire::DecodedMessage& r : plausible_frames(all)) {
    if (!last) first_ns = origin_ns = measured_ns(r);
    const std::uint64_t step = last ? ahead(last->counter, r.counter) : 0;
    if (last && step == 0) {
      last = r;
      continue;
    }
    const double x = (ticks + static_cast<double>(step)) / kSlowHz,
                 y = 1e-9 * static_cast<double>(measured_ns(r) - origin_ns);
    const auto frames = r.behind / r.length;
    const bool waited = r.behind >= 1024 || frames / kSlowHz > (y - last_y) / 2;
    last_y = y;
    const Verdict verdict = !last                 ? Verdict::kAgree
                            : step > kModulus / 2 ? Verdict::kDisagree
                            : measured            ? agreement.of(x, y, waited)
                                                  : Verdict::kAgree;
    if (verdict == Verdict::kDisagree) {
      ++session;
      origin_ns = measured_ns(r);
      ticks = last_y = 0;
      angle.reset();
      agreement = {};
    } else {
      ticks += static_cast<double>(step);
    }
    last = r;
    if (verdict == Verdict::kUncertain) continue;
    Expected e{1e-9 * static_cast<double>(origin_ns - first_ns) + ticks / kSlowHz, r.gyro[0].value * scale * kSlowHz,
               1 / kSlowHz, session};
    if (accumulated) {
      const std::optional<double> before = std::exchange(angle, r.gyro[0].value);
      e.interval_s = ticks / kSlowHz - std::exchange(angle_s, ticks / kSlowHz);
      if (!before || e.interval_s > 2 + 1e-9) continue;
      double difference = r.gyro[0].value - *before;
      difference -= wrap * std::round(difference / wrap);
      e.rate_deg_per_h = difference * scale / e.interval_s;
    }
    expected.push_back(e);
  }
  return expected;
}

std::vector<wire::DecodedMessage> random_frames(const wire::FrameDescription& description, std::mt19937& random) {
  const auto chance = [&](double p) { return std::uniform_real_distribution<>()(random) < p; };
  const bool accumulated = description.gyro.meaning == wire::RateEncoding::kAccumulated;
  const double likely = chance(0.5) ? 0.002 : 0.02;
  std::vector<wire::DecodedMessage> frames;
  std::uint64_t counter = random() % kModulus;
  double host_s = kBegin_s, pulses = 0, stall_s = 0;
  while (frames.size() < 600) {
    std::uint64_t step = 1;
    if (chance(likely)) step += std::uint64_t{1} << random() % 17;  // frames lost
    if (chance(likely / 10)) step += 65536;
    host_s += static_cast<double>(step) / kSlowHz;
    counter += step;
    pulses += 170'000 / kSlowHz * static_cast<double>(step);
    if (chance(likely / 4)) counter = random() % kModulus;                       // reset
    if (chance(likely / 4)) host_s += chance(0.5) ? 20.0 : -20.0;                // host clock set, or silence
    if (chance(likely / 4)) stall_s = 0.1 * static_cast<double>(random() % 40);  // the reader is late
    stall_s = std::max(0.0, stall_s - 1 / kSlowHz);
    wire::DecodedMessage r;
    r.length = description.max_frame_bytes;
    r.offset = frames.size() * r.length;
    r.has_gyro = r.has_counter = r.gyro[0].carried = r.gyro[0].valid = true;
    r.counter = (chance(likely / 2) ? counter + random() : counter) % kModulus;
    r.gyro[0].value = accumulated ? std::floor(std::fmod(pulses, 4294967296.0)) : 17'000;
    r.behind = static_cast<std::uint32_t>(stall_s * kSlowHz) * r.length;
    r.arrival_ns = std::llround(1e9 * (host_s + stall_s + 0.005 * std::uniform_real_distribution<>()(random)));
    frames.push_back(r);
    if (chance(likely)) frames.push_back(r);
    if (chance(likely) && frames.size() > 1) std::swap(frames[frames.size() - 1], frames[frames.size() - 2]);
  }
  return frames;
}

class RandomTimelines : public testing::TestWithParam<std::tuple<TimeSource, const char*>> {};

TEST_P(RandomTimelines, AgreeWithTheReference) {
  const auto [source, meaning] = GetParam();
  const char* number = std::getenv("PRISM_SEQUENCES");
  const int sequences = (number ? std::atoi(number) : 400) / 4;
  const auto description = timeline_description(meaning, kSlowHz);
  for (int seed = 0; seed < sequences; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    const auto readings = random_frames(*description, random);
    std::vector<TrueFrame> frames;
    for (const auto& reading : readings) frames.push_back({reading, 0});
    const auto samples = Timeline(description, source).run(frames);
    const auto expected = reference(*description, readings, source == TimeSource::kDevice);
    ASSERT_EQ(samples.size(), expected.size()) << "seed " << seed;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Sample& s = samples[i].sample;
      ASSERT_EQ(samples[i].session, expected[i].session) << "seed " << seed << ", sample " << i;
      ASSERT_NEAR(1e-9 * static_cast<double>(s.time_ns - samples[0].sample.time_ns),
                  expected[i].time_s - expected[0].time_s, 1e-6)
          << "seed " << seed << ", sample " << i;
      ASSERT_NEAR(s.rate_deg_per_h, expected[i].rate_deg_per_h, 1e-6 * std::abs(expected[i].rate_deg_per_h))
          << "seed " << seed << ", sample " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, RandomTimelines,
                         testing::Combine(testing::Values(TimeSource::kDevice, TimeSource::kRawBytes),
                                          testing::Values("increment", "accumulated")));

}  // namespace
}  // namespace prism
