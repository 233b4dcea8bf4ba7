// SPDX-License-Identifier: MIT
// Readings to samples: unwrapped counters, lost frames, rates from angles, accurate stamps, stalls of the reader
// (clock.txt).
#include "drivers/clock.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "drivers/wire/decode/frame_decoder.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/support/scripts.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using test::next;
using Lines = std::vector<std::string>;

constexpr std::int64_t kEpochNs = 1'700'000'000'000'000'000;
constexpr double kTrueRateDegPerH = 8.4652;

/// 10 Hz without a counter.
constexpr const char* kPlain = R"({"format": "prism-frames", "version": 1, "name": "plain", "line": {"baud": 115200},
  "rate_hz": 10, "kinds": [{"name": "k", "sync": {"bytes": "AB CD"}, "length": 10,
  "checks": {"kind": "crc", "width": 16, "poly": "0x1021", "to": -2, "at": -2},
  "fields": {"rate": {"at": 2, "type": "s32"}, "t": {"at": 6, "type": "s16"}}}],
  "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}}, "temperature": {"field": "t"}})";

/// A description by its name: "plain", "loose" (trplg at 1000 Hz from a device whose clock has an error up to 5 %),
/// "triggered" (increments, a counter of 2000 Hz), a rate in Hz (trplg), or a shipped one.
FrameDescriptionPtr described(const std::string& name) {
  if (name == "plain") return test::description_of(kPlain);
  const bool is_triggered = name == "triggered", is_rate = name.front() >= '0' && name.front() <= '9';
  if (name != "loose" && !is_rate && !is_triggered) return test::shipped(name);
  std::string text = test::read_file(test::frames_dir() / (is_triggered ? "trplg-increment.json" : "trplg.json"));
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  if (name == "loose") {
    replace("\"rate_hz\": 200", "\"rate_hz\": 1000");
    text.replace(text.find("\"rate_tolerance\": "), 24, "\"rate_tolerance\": 0.05,");
  } else if (is_rate) {
    replace("\"rate_hz\": 200", "\"rate_hz\": " + name);
  } else {
    replace("\"counter\": {\"field\": \"counter\",",
            "\"counter\": {\"field\": \"counter\", \"ticks_per_s\": 2000, \"step_varies\": true,");
  }
  return test::description_of(text);
}

/// A gyro, its line and the clock. The truth: a frame is measured one period after the one before, and arrives one wire
/// time and its delay later.
class ClockPlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "gyro") {  // NAME [device] [switch S]
      frames_ = described(next<std::string>(words));
      drivers::ClockSettings settings;
      for (std::string word; words >> word;) {
        if (word == "device") settings.source = drivers::ClockSource::kDevice;
        if (word == "switch") settings.switch_s = next<double>(words);
      }
      clock_.emplace(frames_, settings);
      true_hz_ = frames_->rate_hz;
    } else if (command == "true_hz") {
      true_hz_ = next<double>(words);
    } else if (command == "counter") {  // of the next frame
      counter_ = next<std::uint64_t>(words);
    } else if (command == "uncounted") {
      is_counted_ = false;
    } else if (command == "others") {  // messages without data between the frames
      has_others_ = true;
    } else if (command == "late" || command == "stalled") {  // FROM TO SECONDS: later; or all when TO is measured
      const auto from = next<int>(words), to = next<int>(words);
      const auto late_s = next<double>(words);
      delay_s_ = [=, is_stall = command == "stalled", hz = true_hz_](int i) {
        return i < from || i >= to ? 0 : is_stall ? (to - i) / hz : late_s;
      };
    } else if (command == "jitter") {
      jitter(next<std::string>(words));
    } else if (command == "skip") {  // these frames are lost
      skip(next<int>(words));
    } else if (command == "reset") {
      clock_->reset();
    } else if (command == "earlier") {  // the host's time, from here on
      shift_ns_ -= 1'000'000'000 * next<std::int64_t>(words);
    } else if (command == "frames") {
      return frames(next<int>(words));
    } else if (command == "one") {
      return one(words);
    } else if (command == "right") {  // WORST [RMS]: of the stamps; RMS: both of the second half
      const auto worst = next<double>(words);
      return {right(worst, next<double>(words))};
    } else if (command == "exact") {
      return {is_exact() ? "yes" : "no"};
    } else if (command == "angle") {
      return {fmt::format("{:.2f}", angle())};
    } else if (command == "period") {  // TOLERANCE
      const drivers::ClockStatus& status = clock_->status();
      const double error = status.period_s * true_hz_ - 1;
      return {fmt::format("{}, {}", status.period_is_estimated ? "estimated" : "nominal",
                          std::abs(error) < next<double>(words) ? "right" : fmt::format("wrong by {:.3g}", error))};
    } else if (command == "residual") {
      return {fmt::format("{:.6f} s", clock_->status().residual_s)};
    } else if (command == "status") {
      return {status()};
    } else if (command == "stream") {
      return stream(words);
    } else {
      return {"unknown command"};
    }
    return {};
  }

 private:
  struct Stamped {
    Sample sample;
    double true_s;
  };

  static double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns - kEpochNs); }

  void jitter(const std::string& of) {
    const auto random = std::make_shared<std::mt19937>(of == "hurried" ? 9 : 3);
    if (of == "uart") {
      delay_s_ = [=, delay = std::exponential_distribution<double>(1 / 0.3e-3)](int i) mutable {
        return i % 1000 == 77 ? 0.006 : delay(*random);
      };
    } else if (of == "usb") {  // an adapter that delivers the bytes of 16 ms at once
      delay_s_ = [hz = true_hz_](int i) {
        const double t = i / hz + 0.0003;
        return std::ceil(t / 0.016) * 0.016 - t;
      };
    } else if (of == "hurried") {  // a hundred times faster than real time
      delay_s_ = [=](int i) { return static_cast<double>((*random)() % 500) * 1e-3 - 0.99 * i / 200; };
    } else {  // interrupted: from 25 s on for 12 s; then the frames follow one by one, each in a chunk of its own
      delay_s_ = [](int i) { return i < 5000 ? 0 : std::max(0.0, 37 - i / 200.0 + 1e-4 * (i - 5000)); };
    }
  }

  void skip(int count) {
    number_ += count, counter_ += static_cast<std::uint64_t>(count), measured_s_ += count / true_hz_;
  }

  double wire_s() const { return 1e-9 * frames_->wire.byte_time_ns() * frames_->max_frame_bytes; }

  /// The frame that is measured now; the next one is one period later.
  DecodedMessage next_frame() {
    DecodedMessage reading;
    reading.length = frames_->max_frame_bytes;
    reading.offset = static_cast<std::uint64_t>(number_) * reading.length;
    reading.arrival_ns = kEpochNs + shift_ns_ + std::llround(1e9 * (measured_s_ + wire_s() + delay_s_(number_)));
    reading.has_gyro = reading.gyro[0].carried = reading.gyro[0].valid = true;
    reading.has_counter = is_counted_;
    reading.counter = is_counted_ ? counter_ % frames_->counter->modulus : 0;
    reading.gyro[0].value = std::fmod(std::floor(kTrueRateDegPerH * measured_s_ / frames_->axes[0].scale), 0x1p32);
    reading.temperature_degc = 25;
    skip(1);
    return reading;
  }

  void push(const DecodedMessage& reading, double true_s) {
    if (!clock_->push(reading)) return;
    if (const auto sample = clock_->sample(reading, 0)) samples_.push_back({*sample, true_s});
  }

  Lines frames(int count) {
    samples_.clear();
    for (int i = 0; i < count; ++i) {
      const double true_s = measured_s_;
      DecodedMessage reading = next_frame();
      push(reading, true_s);
      reading.has_counter = reading.has_gyro = false;
      if (has_others_) push(reading, true_s);
    }
    return {told()};
  }

  /// "399 samples, to 1.99500 s, 7 missing"
  std::string told() const {
    std::string text = fmt::format("{} samples, to {:.5f} s", samples_.size(), seconds(samples_.back().sample.time_ns));
    int back = 0, differ = 0;
    std::uint64_t missing = 0;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Sample& sample = samples_[i].sample;
      missing += sample.missing_frames, differ += sample.clocks_differ;
      const std::int64_t before_ns = samples_[i > 0 ? i - 1 : 0].sample.time_ns;
      back += sample.time_ns < before_ns;
      if (sample.time_ns - before_ns > 1'000'000'000)
        text += fmt::format(", none from {:.5f} to {:.5f} s", seconds(before_ns), seconds(sample.time_ns));
    }
    if (missing > 0) text += fmt::format(", {} missing", missing);
    if (back > 0) text += fmt::format(", {} times back", back);
    if (differ > 0) text += ", the clocks differ";
    return text;
  }

  /// The next frame: "same" as the last one, or changed.
  Lines one(std::istream& words) {
    const double true_s = measured_s_;
    DecodedMessage reading = last_.value_or(DecodedMessage());
    std::string word;
    const bool is_same = static_cast<bool>(words >> word) && word == "same";
    if (!is_same) reading = next_frame();
    for (; !word.empty(); word = next<std::string>(words)) {
      if (word == "invalid") reading.gyro[0].valid = false;
      if (word == "damaged") reading.damaged = next<std::uint32_t>(words);
      if (word == "value") reading.gyro[0].value = std::stod(next<std::string>(words));
      if (word == "triggered") {  // ticks of 0.5 ms after the last one
        const auto ticks = next<std::uint64_t>(words);
        reading.counter = last_->counter + ticks;
        reading.arrival_ns = last_->arrival_ns + static_cast<std::int64_t>(ticks) * 500'000;
      }
    }
    last_ = reading;
    samples_.clear();
    push(reading, true_s);
    const std::string session = clock_->began_session() ? ", a session begins" : "";
    if (samples_.empty()) return {"no sample" + session};
    const Sample& sample = samples_[0].sample;
    return {fmt::format("{:.5f} s, {:.6g} deg/h over {:.6g} s{}", seconds(sample.time_ns), sample.rate_deg_per_h,
                        sample.interval_s, session)};
  }

  std::string right(double most_worst, double most_rms) const {
    double squares = 0, worst = 0;
    const std::size_t first = most_rms > 0 ? samples_.size() / 2 : 0;
    for (std::size_t i = first; i < samples_.size(); ++i) {
      const double error = std::abs(seconds(samples_[i].sample.time_ns) - samples_[i].true_s);
      squares += error * error;
      worst = std::max(worst, error);
    }
    const double rms = std::sqrt(squares / static_cast<double>(samples_.size() - first));
    return worst <= most_worst && (most_rms == 0 || rms <= most_rms) ? "yes"
                                                                     : fmt::format("{:.3g}, {:.3g}", worst, rms);
  }

  bool is_exact() const {
    const auto step_ns = std::llround(1e9 / true_hz_);
    for (std::size_t i = 0; i < samples_.size(); ++i)
      if (samples_[i].sample.time_ns - samples_[0].sample.time_ns != static_cast<std::int64_t>(i) * step_ns)
        return false;
    return true;
  }

  /// Of the last samples, arcsec.
  double angle() const {
    double angle = 0;
    for (const Stamped& each : samples_) angle += each.sample.rate_deg_per_h * each.sample.interval_s;
    return angle;
  }

  std::string status() const {
    const drivers::ClockStatus& status = clock_->status();
    return fmt::format("{} missing, {} by arrival, {} duplicates, {} resets", status.missing_frames,
                       status.missing_by_arrival, status.duplicates, status.resets);
  }

  /// SECONDS of bytes through the decoder. "stall S BYTES": the reader stalls after 10 s, and the buffer keeps the
  /// first bytes of that time; "between N TEXT": before every N-th frame; "damage N": to every N-th frame.
  Lines stream(std::istream& words) {
    const auto length_s = next<double>(words);
    double stall_s = 0;
    std::size_t buffer_bytes = 0;
    int every = 0, damage = 0;
    std::string text;
    for (std::string word; words >> word;) {
      if (word == "stall") stall_s = next<double>(words), buffer_bytes = next<std::size_t>(words);
      if (word == "between") every = next<int>(words), text = test::rest_of(words) + "\r\n";
      if (word == "damage") damage = next<int>(words);
    }
    FrameEncoder encoder(frames_);
    FrameDecoder decoder(frames_);
    const double period_s = frames_->period_s() / static_cast<double>(frames_->sent_kinds.size());
    const double stall_end_s = 10 + stall_s;
    std::vector<std::uint8_t> bytes, kept;
    std::vector<DecodedMessage> readings;
    std::uint64_t lost = 0;
    samples_.clear();
    const auto give = [&](const std::vector<std::uint8_t>& given, double at_s) {
      readings.clear();
      decoder.feed(given, kEpochNs + std::llround(1e9 * at_s), readings);
      for (const DecodedMessage& reading : readings) push(reading, 0);
    };
    for (int i = 0; i * period_s < length_s + stall_s; ++i) {
      const double arrival_s = i * period_s + wire_s();
      bytes.clear();
      if (every > 0 && i % every == 0) bytes.assign(text.begin(), text.end());
      const std::size_t begin = bytes.size();
      encoder.encode(
          {.rate_deg_per_h = {kTrueRateDegPerH}, .interval_s = period_s, .temperature_degc = 25, .uhfo_v = 1}, bytes);
      if (damage > 0 && i % damage == 7) bytes[begin + 2 + static_cast<std::size_t>(i / damage) % 8] ^= 0x55, ++lost;
      if (arrival_s >= stall_end_s && !kept.empty()) give(std::exchange(kept, {}), stall_end_s);
      if (arrival_s < 10 || arrival_s >= stall_end_s) {
        give(bytes, arrival_s);
      } else if (kept.size() + bytes.size() <= buffer_bytes) {
        kept.insert(kept.end(), bytes.begin(), bytes.end());
      } else {
        ++lost;
      }
    }
    return {fmt::format("{}, {:g} degC; {} lost", told(), samples_.back().sample.temperature_degc, lost), status()};
  }

  FrameDescriptionPtr frames_;
  std::optional<drivers::Clock> clock_;
  double true_hz_ = 0, measured_s_ = 0;
  std::function<double(int)> delay_s_ = [](int) { return 0.0; };
  int number_ = 0;
  std::uint64_t counter_ = 0;
  std::int64_t shift_ns_ = 0;
  bool is_counted_ = true, has_others_ = false;
  std::optional<DecodedMessage> last_;
  std::vector<Stamped> samples_;  ///< of the last command
};

TEST(Clock, Scripts) { test::expect_scripts<ClockPlayer>("wire/clock.txt"); }

}  // namespace
}  // namespace prism::wire
