// SPDX-License-Identifier: MIT
// Limits of a sensor's values and of their slope: values outside are reported as implausible and not used.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "compensation/model.hpp"
#include "compensation/sample.hpp"
#include "compensation/sensors.hpp"

namespace prism::compensation {

// Limits the change of the published bias per row to the fastest change in the model's training record.

struct SlewSettings {
  bool limited = true;
  std::optional<double> max_slew_deg_per_h_per_s;  ///< > 0; none: derived from the model

  bool operator==(const SlewSettings&) const = default;
};

/// kSlewMargin · (largest − smallest bias over the training box) / length_s, deg/h per second. The fastest change
/// within the training box crosses all of it in one window: a ramp that reverses at once moves the slope through its
/// range in length_s, and no mean over length_s changes faster. The margin is for a least-squares slope, which responds
/// 1.5 times as fast in the middle of its window, and for curved models, which are steeper at the edge. Without a box,
/// ±max_bias_deg_per_h replaces the span. At least kLeastSlew, one last digit of the log per row. Infinite if nothing
/// is limited.
inline constexpr double kSlewMargin = 4, kLeastSlew = 1e-6;
double greatest_slew_deg_per_h_per_s(const Model& model, const SlewSettings& settings, double max_bias_deg_per_h);

/// Limits the bias of one model. The first value, and the first one of another model, is not limited.
class SlewLimit {
 public:
  /// `bias_deg_per_h`, finite, is the prediction of `by` at the end of `second`; moves it to the value to publish.
  /// Returns true if it was moved. `most_deg_per_h_per_s`: > 0.
  bool follow(double& bias_deg_per_h, std::int64_t second, const Model& by, double most_deg_per_h_per_s);
  void reset() { by_ = nullptr; }

 private:
  const Model* by_ = nullptr;  ///< the model of the last bias; only compared
  double bias_deg_per_h_ = 0;
  std::int64_t second_ = 0;
};

/// Limits of one sensor, in the unit of its quantity. The range is closed. An infinite limit is not checked.
struct SensorLimits {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  /// Maximum slope, units/s: |v − v₀| <= step + slope · (t − t₀).
  double greatest_slope_per_s = std::numeric_limits<double>::infinity();
  double step = 0;  ///< difference that is always allowed (noise, quantisation)
  /// A value that is constant for longer is the last one of a failed sensor. Off by default, because a quantised value
  /// may be constant in a soak.
  double stuck_s = std::numeric_limits<double>::infinity();

  /// Replaces the limits that are given. `step` cannot be given.
  void take(const SensorStatement& stated);
  bool operator==(const SensorLimits&) const = default;
};

/// The defaults fit every gyro: without any setting −273 or 1000 degC, or a rate of 3.4e38 deg/h, is rejected.
struct PlausibilityLimits {
  SensorLimits rate{-3.6e7, 3.6e7};  ///< deg/h: 10 000 deg/s
  /// degC. 1 degC/s is above every chamber; gyro thermometers are quantised by 1 degC at most.
  SensorLimits temperature{-90, 200, 1, 2};
  SensorLimits uhfo{-1000, 1000};  ///< V

  void take(const SensorStatements& stated);
  bool operator==(const PlausibilityLimits&) const = default;
};

/// Why a value was rejected.
struct Rejection {
  enum class Reason : std::uint8_t { kNone, kOutsideLimits, kTooFast, kStuck, kOutsideField };
  Reason reason = Reason::kNone;
  double found = kUnknown;                 ///< kUnknown for kOutsideField, which the decoder found
  double low = kUnknown, high = kUnknown;  ///< kOutsideLimits, kTooFast: the range of plausible values
  double seconds = 0;                      ///< kTooFast: s since v₀; kStuck: s for which the value has been constant

  explicit operator bool() const { return reason != Reason::kNone; }
};

/// One per quantity.
struct Rejections {
  Rejection rate, temperature, uhfo;
};

/// "found -273 degC, expected -90 to 200": one human-readable line, without the sensor's name. Empty for kNone.
std::string rejection_text(const Rejection& rejection, const char* unit);

/// Checks one sensor during one session. Unknown values (NaN) are plausible and not checked.
///
/// Slope: a value is plausible if |v − v₀| <= step + slope · (t − t₀). The first plausible value at least 1 s after v₀
/// becomes the next v₀. So a spike affects only itself, and a sensor that stays at another value is accepted again once
/// it could have reached it.
///
/// The first v₀ is the first value at least 1 s after the session's first one, if it agrees with the majority of the
/// values so far (by the formula, with t − t₀ of at least 1 s). If it does not agree, it is rejected, and the
/// majority's value is v₀. This needs two values that agree, or three values. Values before the first v₀ pass the slope
/// check.
class SensorCheck {
 public:
  explicit SensorCheck(const SensorLimits& limits);

  /// Returns true if the value is plausible, and stores what the next checks need. Times must not go back. Inline,
  /// because most values need only two comparisons.
  bool check(double value, std::int64_t time_ns) {
    if (std::isnan(value)) return true;
    if (!(value >= limits_.low && value <= limits_.high)) return outside_limits(value);
    return (!has_slope_ || slope_holds(value, time_ns)) && (!may_stick_ || moves(value, time_ns));
  }
  /// Reason for the last rejected value.
  const Rejection& rejection() const { return rejection_; }

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
  bool outside_limits(double value);
  bool slope_holds(double value, std::int64_t time_ns);
  bool find_reference(double value, std::int64_t time_ns);
  bool follows(double value, double elapsed_s) const;
  bool moves(double value, std::int64_t time_ns);

  SensorLimits limits_;
  bool has_slope_, may_stick_;
  double reference_ = kUnknown, still_ = kUnknown;  ///< v₀; before the first v₀ the candidate for it
  std::int64_t reference_ns_ = 0, still_since_ns_ = 0;
  bool has_reference_ = false;
  std::int64_t start_ns_ = kNever;  ///< time of the first value
  int values_ = 0, votes_ = 0;      ///< before the first v₀: values so far; votes for the candidate
  Rejection rejection_;
};

/// Checks the sensors of one axis. Cost: a few comparisons per sample.
class Plausibility {
 public:
  explicit Plausibility(const PlausibilityLimits& limits);

  /// Returns the implausible quantities of the sample, also those outside their field (Sample::out_of_bounds). Takes
  /// the samples of one session in order of time.
  QuantitySet implausible(const Sample& sample) {
    const QuantitySet& out = sample.out_of_bounds;
    return {out.rate || !rate_.check(sample.rate_deg_per_h, sample.time_ns),
            out.temperature || !temperature_.check(sample.temperature_degc, sample.time_ns),
            out.uhfo || !uhfo_.check(sample.uhfo_v, sample.time_ns)};
  }
  /// Call after implausible(sample), with its result. Sets the reason of each implausible quantity in `rejections` that
  /// has none yet.
  void explain(const Sample& sample, QuantitySet implausible, Rejections& rejections) const;

 private:
  SensorCheck rate_, temperature_, uhfo_;
};

// Tells a jump that stays from a spike.

/// For the values of one sensor, in order. A jump is rejected as too fast until the sensor could have reached it slowly
/// (SensorCheck); the first plausible value afterwards shows whether it stayed.
class JumpWatch {
 public:
  struct Jump {
    double before = kUnknown, after = kUnknown;  ///< the last value before it, and the value that is now used
  };
  void reject(const Rejection& rejection) {
    if (rejection.reason != Rejection::Reason::kTooFast) return;
    if (!is_rejecting()) before_ = (rejection.low + rejection.high) / 2;
    last_ = rejection.found;
  }
  /// A plausible value. Returns the jump if it stayed.
  std::optional<Jump> accept(double value) {
    const Jump jump{std::exchange(before_, kUnknown), value};
    const bool stays = std::fabs(value - last_) < std::fabs(value - jump.before);
    return stays ? std::optional(jump) : std::nullopt;
  }
  bool is_rejecting() const { return !std::isnan(before_); }

 private:
  double before_ = kUnknown, last_ = kUnknown;
};

}  // namespace prism::compensation
