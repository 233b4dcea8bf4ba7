// SPDX-License-Identifier: MIT
// What a sensor can say, and how fast it can change: what is beyond is measured, but not believed.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "compensation/sample.hpp"
#include "compensation/sensor_limits.hpp"

namespace prism::compensation {

/// Of one sensor, in the unit of its quantity. What is infinite is not looked at.
struct SensorLimits {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  /// Between two values, beyond `step`, which noise and a coarse quantiser may make at once.
  double greatest_slope_per_s = std::numeric_limits<double>::infinity();
  double step = 0;
  /// A value that stands still for longer is the last one before the sensor died. Off: a quantised one at a soak
  /// stands.
  double stuck_s = std::numeric_limits<double>::infinity();

  /// What is stated takes the place of what is here.
  void take(const SensorStatement& stated);
  bool operator==(const SensorLimits&) const = default;
};

/// The presets hold for every gyro: nobody who says nothing believes −273 or 1000 degC, or a rate of 3.4e38 deg/h.
struct PlausibilityLimits {
  SensorLimits rate{-3.6e7, 3.6e7};  ///< deg/h: 10 000 deg/s
  /// degC. 1 degC/s is above every chamber; thermometers of gyros are quantised by 1 degC at most.
  SensorLimits temperature{-90, 200, 1, 2};
  SensorLimits uhfo{-1000, 1000};  ///< V

  void take(const SensorStatements& stated);
  bool operator==(const PlausibilityLimits&) const = default;
};

/// Why a value is not believed.
struct Doubt {
  enum class Reason : std::uint8_t { kNone, kOutOfRange, kTooFast, kStuck, kOutOfBounds };
  Reason reason = Reason::kNone;
  double found = kUnknown;                 ///< not kOutOfBounds, where the decoder saw it
  double low = kUnknown, high = kUnknown;  ///< kOutOfRange, kTooFast: between them it would have been believed
  double seconds = 0;  ///< kTooFast: since the value that it is measured by; kStuck: for how long it stands still

  explicit operator bool() const { return reason != Reason::kNone; }
};

/// One for each quantity.
struct Doubts {
  Doubt rate, temperature, uhfo;
};

/// "found -273 degC, expected -90 to 200": one line for people, without the sensor's name.
std::string doubt_text(const Doubt& doubt, const char* unit);

/// One sensor of one session. Unknown values are not judged.
///
/// Slope: a value is believed where |v − v₀| <= step + slope · (t − t₀), v₀ the last value that was believed a second
/// or more after the v₀ before it. So a spike costs itself, and a sensor that stays elsewhere is believed again once it
/// could have come there. In the first second of a session there is no v₀: one value alone proves nothing.
class SensorCheck {
 public:
  explicit SensorCheck(const SensorLimits& limits);

  /// Values come in order of time. Inline: for nearly all of them two comparisons are enough.
  bool believes(double value, std::int64_t time_ns) {
    if (std::isnan(value)) return true;
    if (!(value >= limits_.low && value <= limits_.high)) return out_of_range(value);
    return (!has_slope_ || slope_holds(value, time_ns)) && (!may_stick_ || moves(value, time_ns));
  }
  /// Of the last value that was not believed.
  const Doubt& doubt() const { return doubt_; }

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
  bool out_of_range(double value);
  bool slope_holds(double value, std::int64_t time_ns);
  bool moves(double value, std::int64_t time_ns);

  SensorLimits limits_;
  bool has_slope_, may_stick_;
  double before_ = kUnknown, still_ = kUnknown;
  std::int64_t before_ns_ = kNever, still_since_ns_ = 0;
  Doubt doubt_;
};

/// The sensors of one axis. A few comparisons a sample.
class Plausibility {
 public:
  explicit Plausibility(const PlausibilityLimits& limits);

  /// What of the sample is not believed.
  QuantitySet implausible(const Sample& sample) {
    const QuantitySet& out = sample.out_of_bounds;
    return {out.rate || !rate_.believes(sample.rate_deg_per_h, sample.time_ns),
            out.temperature || !temperature_.believes(sample.temperature_degc, sample.time_ns),
            out.uhfo || !uhfo_.believes(sample.uhfo_v, sample.time_ns)};
  }
  /// Why: adds to `doubts` what was found in that sample, the last one, where nothing stands there yet.
  void explain(const Sample& sample, QuantitySet implausible, Doubts& doubts) const;

 private:
  SensorCheck rate_, temperature_, uhfo_;
};

}  // namespace prism::compensation
