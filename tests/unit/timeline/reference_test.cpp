// SPDX-License-Identifier: MIT
// Random sequences of all damages: the clock "device" and raw bytes agree with a slow reference, which keeps complete
// lists and is written from the rules of docs/frames.md. PRISM_SEQUENCES sets their number.
#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/unit/timeline/truth.hpp"

namespace prism {
namespace {

using test::TimeSource;

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
    const bool waited = r.behind >= 1024 || r.behind / r.length / kSlowHz > (y - last_y) / 2;
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
  double host_s = test::kBegin_s, pulses = 0, stall_s = 0;
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
  const auto description = test::timeline_description(meaning, kSlowHz);
  for (int seed = 0; seed < sequences; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    const auto readings = random_frames(*description, random);
    std::vector<test::TrueFrame> frames;
    for (const auto& reading : readings) frames.push_back({reading, 0});
    const auto samples = test::Timeline(description, source).run(frames);
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
